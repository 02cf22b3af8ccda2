#pragma once
// The planned paths against the mission's geofence.

#include <vector>

#include "common/diagnostic.h"
#include "mission/check/route_plan.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// Reports the first place where the vehicle, a ball of `radius` (m), crosses the fence
/// (CHK-FENCE).
void check_fence(const std::vector<PlannedRouteLeg>& legs, const Route& route,
                 const Mission& mission, double radius, Diagnostics& diagnostics);

}  // namespace dive::mission
