#pragma once
// Static checks of a mission against its map, without planning.

#include <vector>

#include "common/diagnostic.h"
#include "mission/document/mission.h"
#include "mission/document/rules.h"
#include "planning/world/world.h"

namespace dive::mission {

/// Checks start and goals against map and limits; each finding is at the position of the value in
/// the mission file. `mission` has passed load_mission(). Codes CHK-*: see world_rules(). A goal
/// without a heading is checked at the best possible heading and, where the vehicle may roll, by
/// its centre alone: no path can avoid what is reported.
void check_against_world(const Mission& mission, const planning::World& world,
                         const planning::RobotHull& hull, Diagnostics& diagnostics);

/// The codes reported by check_against_world().
[[nodiscard]] std::span<const Rule> world_rules();

/// The codes reported by planning::parse_sdf().
[[nodiscard]] std::span<const Rule> map_rules();

/// Every code that can be reported for a mission file, in the order of the checks.
[[nodiscard]] std::vector<Rule> all_rules();

}  // namespace dive::mission
