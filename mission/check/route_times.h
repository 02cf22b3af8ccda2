#pragma once
// When the vehicle is expected where on the nominal route: the speed over ground of every line
// under the declared current of that time, slower where heave alone changes the depth; the turn at
// the begin of every leg; and the waits between.

#include <span>
#include <vector>

#include "mission/check/route.h"
#include "mission/check/route_plan.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// Times since the mission started, s.
struct LegTimes {
  double begins_s = 0.0;           ///< After the waits before the leg.
  std::vector<double> waypoint_s;  ///< At each waypoint of the leg's path.
  double arrives_s = 0.0;          ///< At the goal.
  double ends_s = 0.0;             ///< After the dwell.
};

struct RouteTimes {
  std::vector<LegTimes> legs;  ///< Times of the route's legs, in its order.
  double ends_s = 0.0;         ///< After the waits and ascents that follow the last leg.
};

/// `legs` are the plans of the route's legs.
[[nodiscard]] RouteTimes route_times(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                                     const Mission& mission);

/// Time to swim a line, or a path, in the current of the time `at_s`, s. In an unknown environment
/// the vehicle keeps its speed over ground down to the mission's, so that a following current saves
/// no time.
[[nodiscard]] double line_time_s(const Mission& mission, const Eigen::Vector3d& from_W,
                                 const Eigen::Vector3d& to_W, double at_s);
[[nodiscard]] double path_time_s(const Mission& mission, std::span<const Eigen::Vector3d> path,
                                 double at_s);

/// Time to ascend vertically by `height_m`, s.
[[nodiscard]] double ascent_time_s(double height_m);

}  // namespace dive::mission
