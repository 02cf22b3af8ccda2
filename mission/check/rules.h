#pragma once
// Static checks of a mission against its map: what can be known without planning.

#include <vector>

#include "common/diagnostic.h"
#include "mission/document/mission.h"
#include "mission/document/rules.h"
#include "planning/world/world.h"

namespace dive::mission {

/// Start and goals against map and limits, each finding at the value's own place in the mission
/// file. `mission` has passed load_mission(). Codes CHK-*: see world_rules(). A goal without a
/// heading is judged by the best heading it could take, and, where the vehicle may roll, by its
/// centre alone: what is reported cannot be flown around.
void check_against_world(const Mission& mission, const planning::World& world,
                         const planning::RobotHull& hull, Diagnostics& diagnostics);

/// The codes of check_against_world().
[[nodiscard]] std::span<const Rule> world_rules();

/// Every code that a mission file can be answered with, in the order in which it meets them.
[[nodiscard]] std::vector<Rule> all_rules();

}  // namespace dive::mission
