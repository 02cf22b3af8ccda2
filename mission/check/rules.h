#pragma once
// Static checks of a mission against its map: what can be known without planning.

#include "common/diagnostic.h"
#include "mission/document/mission.h"
#include "planning/world/world.h"

namespace dive::mission {

/// Start and goals against map and limits, each finding at the value's own place in the mission
/// file. Codes CHK-*: goal (or start) inside an obstacle, or nearer to one than the hull allows;
/// goal above the surface; goal deeper than max_depth; goal below min_altitude; a `surface` state
/// reached under an overhead; a leg too long for its timeout even in a straight line.
void check_against_world(const Mission& mission, const planning::World& world,
                         const planning::RobotHull& hull, Diagnostics& diagnostics);

}  // namespace dive::mission
