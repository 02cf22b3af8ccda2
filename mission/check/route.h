#pragma once
// The nominal route: the legs a mission swims when nothing goes wrong.

#include <string>
#include <vector>

#include "behaviors/leg.h"
#include "common/se3.h"
#include "mission/document/mission.h"
#include "planning/world/scene.h"

namespace dive::mission {

struct RouteLeg {
  std::string state;
  Span span;  ///< Of the goal in the mission file.
  Eigen::Vector3d from_W;
  behaviors::LegGoal goal;
};

struct Route {
  Pose start;
  behaviors::LegSettings settings;  ///< Shared by all legs.
  std::vector<RouteLeg> legs;
  double hold_s = 0.0;              ///< Holds and dwells on the way.
  double ascent_m = 0.0;            ///< Of all surface states on the way.
  std::vector<std::string> leaves;  ///< Leaf states in the order entered.
  std::string final_state;          ///< Empty when the walk was cut off (a loop).
};

/// Walks the machine with every leaf succeeding at once and guards as on deck (full battery,
/// nothing elapsed). Loops are cut off after `kMaxLeaves` leaves.
[[nodiscard]] Route nominal_route(const Mission& mission, const planning::Scene& scene);

inline constexpr std::size_t kMaxLeaves = 1000;

}  // namespace dive::mission
