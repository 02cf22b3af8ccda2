#pragma once
// What must hold of a mission beyond its schema, and can be known from the document alone.

#include <span>

#include "common/diagnostic.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// A rule as `dive check --rules` lists it.
struct Rule {
  const char* code = "";
  Severity severity = Severity::kError;
  const char* sentence = "";  ///< What must hold.
};

/// All codes that load_mission() can report, in the order in which a document passes them.
[[nodiscard]] std::span<const Rule> document_rules();

/// Reports every breach, with the codes MIS-*. Rules that ask where the machine can go are not
/// asked of a machine whose names are wrong.
void check_rules(const Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
