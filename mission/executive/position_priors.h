#pragma once
// What the estimator expects of its position errors, by what the mission states.

#include "common/motion_model.h"
#include "estimation/map_fix_filter.h"
#include "estimation/primitive.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// Options for a mission that uses fixes from the map and a vehicle with that motion model. The
/// slip of its worst axis counts, because a vehicle may lie on its side.
[[nodiscard]] estimation::MapFixOptions map_fix_options(const Mission& mission,
                                                        const MotionModel& motion);

/// `options` with the error of the current that the mission states or implies.
[[nodiscard]] estimation::PrimitiveOptions odometry_options(const Mission& mission,
                                                            estimation::PrimitiveOptions options);

}  // namespace dive::mission
