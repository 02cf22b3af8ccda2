#pragma once
// The nominal route: the legs of a mission without failures.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "behaviors/leg.h"
#include "common/se3.h"
#include "mission/document/mission.h"
#include "planning/world/scene.h"

namespace dive::mission {

/// What the vehicle does between two legs.
struct RouteWait {
  double rest_s = 0.0;    ///< Holds.
  double ascent_m = 0.0;  ///< Vertical ascents.
};

struct RouteLeg {
  std::string state;
  Span span;  ///< Span of the goal in the mission file.
  Eigen::Vector3d from_W;
  behaviors::LegGoal goal;
  std::optional<double> dwell_yaw;  ///< Yaw during the dwell, rad; absent: that of the arrival.
  /// Reduced clearance (m) that the mission accepts for a start that lacks the clearance; infinite:
  /// none.
  double reduced_clearance = std::numeric_limits<double>::infinity();
  RouteWait before = {};
};

struct Route {
  Pose start;
  behaviors::LegSettings settings;  ///< Shared by all legs.
  std::vector<RouteLeg> legs;
  RouteWait after;                         ///< After the last leg.
  double ascent_m = 0.0;                   ///< Sum over all surface states on the route.
  std::vector<std::string> atomic_states;  ///< Atomic states in the order entered.
  std::string final_state;                 ///< Empty if the walk was cut off (a loop).
};

/// Walks the machine with every atomic state succeeding at once and guards evaluated as on deck
/// (full battery, nothing elapsed). Loops are cut off after `kMaxAtomicStates` atomic states.
[[nodiscard]] Route nominal_route(const Mission& mission, const planning::Scene& scene);

inline constexpr std::size_t kMaxAtomicStates = 1000;

}  // namespace dive::mission
