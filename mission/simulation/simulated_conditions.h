#pragma once
// Conditions of a mission's simulated dives.

#include "mission/document/mission.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// The defaults, with the current that the mission declares, and with errors of start, map and
/// current of the size that it declares.
[[nodiscard]] vehicle::Conditions simulated_conditions(const Mission& mission);

}  // namespace dive::mission
