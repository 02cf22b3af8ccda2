#pragma once
// What to do before a dive: lines of a dive card, each with a box to tick.

#include <string>
#include <vector>

#include "mission/check/check.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// In the order in which they are done, from the bench to the release. Lines for sensors and
/// settings that the mission does not use are left out.
[[nodiscard]] std::vector<std::string> checklist(const Mission& mission, const CheckReport& report);

}  // namespace dive::mission
