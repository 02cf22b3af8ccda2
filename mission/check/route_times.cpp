#include "mission/check/route_times.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"
#include "common/ground_speed.h"
#include "vehicle/ascent_rates.h"
#include "vehicle/follower.h"

namespace dive::mission {
namespace {

constexpr double kFreeTurn = 0.5;   // rad that the vehicle turns by as it sets off
constexpr double kTurnRate = 0.35;  // rad/s beyond that
constexpr double kMinAhead = 0.1;   // of the bow's unit vector, horizontally: it swims up or down

double duration_s(const RouteWait& wait) { return wait.rest_s + ascent_time_s(wait.ascent_m); }

// The depth that swimming ahead at the line's attitude does not give.
double heave_time_s(const Pose& from, const Pose& to) {
  const Eigen::Vector3d ahead_W = from.q.slerp(0.5, to.q) * Eigen::Vector3d::UnitX();
  const double level = ahead_W.head<2>().norm();
  if (level < kMinAhead) return 0.0;
  const Eigen::Vector3d line_W = to.p - from.p;
  const double swum = line_W.head<2>().norm() * ahead_W.z() / level;
  return std::abs(line_W.z() - swum) / vehicle::FollowerOptions{}.heave_speed;
}

double turn_time_s(const Pose& from, const Pose& to) {
  const double turn = std::abs(wrap_angle(to_rpy(to.q).z() - to_rpy(from.q).z()));
  return std::max(turn - kFreeTurn, 0.0) / kTurnRate;
}

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

double ascent_time_s(double height_m) { return height_m / vehicle::kMeanAscentRate; }

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
      if (i == 1) t += turn_time_s(path[0], path[1]);
      if (i > 0) {
        t += std::max(line_time_s(mission, path[i - 1].p, path[i].p, t),
                      heave_time_s(path[i - 1], path[i]));
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
