#pragma once
// Rules that a mission must satisfy beyond its schema and that the document alone can decide.

#include <span>

#include "common/diagnostic.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// A rule as `dive check --rules` lists it.
struct Rule {
  const char* code = "";
  Severity severity = Severity::kError;
  const char* sentence = "";  ///< The condition that must hold.
};

/// All codes that load_mission() can report, in the order in which they are checked, except those
/// of single states: state_rules() in mission/states/state_elements.h.
[[nodiscard]] std::span<const Rule> document_rules();

/// Reports every violation, with the codes MIS-*. Rules about flow are skipped for a machine with
/// unresolved names.
void check_rules(const Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
