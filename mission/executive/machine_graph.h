#pragma once
// The machine as built, as a drawing (Graphviz DOT) and for other engines (SCXML).

#include <string>

#include "mission/executive/machine.h"

namespace dive::mission {

/// DOT: compound and parallel states as clusters, the executive's own states in grey.
[[nodiscard]] std::string to_dot(const Machine& machine, const std::string& title);

/// SCXML 1.0 with the ECMAScript data model: one data element for every variable of a guard,
/// initially zero or false. A payload command is sent as the event payload.NAME.
[[nodiscard]] std::string to_scxml(const Machine& machine, const std::string& name);

}  // namespace dive::mission
