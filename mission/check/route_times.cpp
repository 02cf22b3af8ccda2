#include "mission/check/route_times.h"

#include <algorithm>

#include "behaviors/surface.h"
#include "common/assert.h"
#include "common/ground_speed.h"

namespace dive::mission {
namespace {

double duration_s(const RouteWait& wait) { return wait.rest_s + ascent_time_s(wait.ascent_m); }

}  // namespace

double line_time_s(const Mission& mission, const Eigen::Vector3d& from_W,
                   const Eigen::Vector3d& to_W, double at_s) {
  const double speed = mission.speed.value;
  const double time_s = swim_time_s(from_W, to_W, speed, mission.current.value.at(at_s));
  return mission.unknown ? std::max(time_s, (to_W - from_W).norm() / speed) : time_s;
}

double path_time_s(const Mission& mission, std::span<const Eigen::Vector3d> path, double at_s) {
  double time_s = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    time_s += line_time_s(mission, path[i - 1], path[i], at_s);
  }
  return time_s;
}

double ascent_time_s(double height_m) { return height_m / behaviors::SurfaceOptions{}.ascent_rate; }

RouteTimes route_times(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                       const Mission& mission) {
  DIVE_DEMAND(legs.size() == route.legs.size());
  RouteTimes times;
  double t = 0.0;
  for (std::size_t l = 0; l < legs.size(); ++l) {
    LegTimes& leg = times.legs.emplace_back();
    t += duration_s(route.legs[l].before);
    leg.begins_s = t;
    const std::vector<Pose>& path = legs[l].plan.waypoints;
    for (std::size_t i = 0; i < path.size(); ++i) {
      if (i > 0) {
        t += line_time_s(mission, path[i - 1].p, path[i].p, t);
      }
      leg.waypoint_s.push_back(t);
    }
    leg.arrives_s = t;
    t += route.legs[l].goal.dwell_s;
    leg.ends_s = t;
  }
  times.ends_s = t + duration_s(route.after);
  return times;
}

}  // namespace dive::mission
