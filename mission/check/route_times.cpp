#include "mission/check/route_times.h"

#include "behaviors/surface.h"
#include "common/assert.h"
#include "common/ground_speed.h"

namespace dive::mission {
namespace {

double duration_s(const RouteWait& wait) { return wait.rest_s + ascent_time_s(wait.ascent_m); }

}  // namespace

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
        t +=
            swim_time_s(path[i - 1].p, path[i].p, mission.speed.value, mission.current.value.at(t));
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
