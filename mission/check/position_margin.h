#pragma once
// How far the position may be off on a planned route, and what that leaves of the clearance: the
// margin of planning/certify/position_margin.h.
//
// The filter of the fixes (estimation/map_fix_filter.h) is carried along the plans at the mission's
// speed, with the fixes that scans of the known map would give there, and no errors: only its
// covariance changes. Not predicted: fixes that an ambiguous view prevents, objects that the map
// lacks, and the position of cameras.

#include <vector>

#include "common/diagnostic.h"
#include "mission/check/route.h"
#include "mission/check/route_plan.h"
#include "mission/document/mission.h"
#include "vehicle/model.h"

namespace dive::mission {

/// A leg with a smaller margin is refused.
inline constexpr double kLeastMargin = 3.5;
/// A leg with a smaller margin is warned of.
inline constexpr double kSafeMargin = 5.0;

/// True if the margins of a mission can be predicted: it has a known map, and no cameras provide
/// its position.
[[nodiscard]] bool has_position_margins(const Mission& mission);

/// Fills in the margin of each planned leg. Demands has_position_margins().
void predict_position_margins(const Route& route, std::vector<PlannedRouteLeg>& legs,
                              const Mission& mission, const planning::World& map,
                              const vehicle::Model& model);

/// Reports legs under an overhead on which nothing corrects the position, unless the mission
/// declares still water (CHK-NO-FIXES).
void check_dead_reckoning(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                          const Mission& mission, const planning::World& map,
                          const planning::RobotHull& hull, Diagnostics& diagnostics);

/// Reports legs with too small a margin (CHK-MARGIN, CHK-MARGIN-SMALL).
void check_position_margins(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                            const Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
