#pragma once
// Supervision (mission/link/supervision.h) over the link. Small on purpose: it uses no plan, and of
// a mission only the known map, in which the scans of the range camera tell its position.

#include <functional>

#include "common/clock.h"
#include "mission/link/supervision.h"
#include "vehicle/link/bus.h"

namespace dive::mission {

/// Monitors from the executive's first command until it has finished, or until this supervisor has
/// brought the vehicle to the surface; also ends when `wanted` returns false. A map of the settings
/// needs its surface.
[[nodiscard]] SupervisorReport supervise(const SupervisorSettings& settings, link::Bus& bus,
                                         Clock& clock, const SupervisorLog& log,
                                         const std::function<bool()>& wanted);

}  // namespace dive::mission
