#include "mission/check/budget.h"

#include <algorithm>

#include <fmt/format.h>

#include "behaviors/trail.h"
#include "mission/check/route_times.h"
#include "mission/document/state_index.h"
#include "planning/world/overhead.h"
#include "vehicle/aqua2_figures.h"
#include "vehicle/ascent_rates.h"

namespace dive::mission {
namespace {

constexpr double kSecondsPerHour = 3600.0;

/// Wh per s, at the mission's speed.
double swimming_power(const Mission& mission, const MotionModel& motion) {
  const double fraction = mission.speed.value / motion.full_speed;
  return vehicle::Aqua2Figures{}.cruise_power_w(fraction) / kSecondsPerHour;
}

/// Wh per s.
double ascent_power(const MotionModel& motion) {
  const double fraction = vehicle::kMeanAscentRate / motion.full_heave;
  return vehicle::Aqua2Figures{}.heave_power_w(fraction) / kSecondsPerHour;
}

/// Resources that a dive of this mission may use.
struct Usable {
  double time_s = 0.0;
  double energy_wh = 0.0;
};

Usable usable(const Mission& mission, const vehicle::Conditions& conditions) {
  return {mission.limits.mission_timeout.value,
          conditions.battery_capacity_wh *
              (conditions.battery_fraction - mission.limits.battery_reserve.value)};
}

// Walks the route point by point, as the vehicle drops its breadcrumbs, and tests at each whether
// turning back is still possible.
void find_turning_points(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                         const Mission& mission, const planning::World& world,
                         const vehicle::Model& model, const Usable& limit, Budget& budget) {
  planning::OverheadIndex overheads(world);
  behaviors::Trail trail;
  const double radius = model.hull.radius();
  const double power = swimming_power(mission, model.motion);
  const double ascent = ascent_power(model.motion);
  const RouteTimes times = route_times(route, legs, mission);
  double distance = 0.0;
  double entered_s = 0.0;  // when the vehicle was last in open water
  double last_out_m = 0.0;
  const auto visit = [&](const Eigen::Vector3d& p_W, double t, const std::string& state) {
    const bool open = !overheads.is_above(p_W, radius);
    trail.add(p_W, open);
    if (open) entered_s = t;
    const behaviors::Trail::Path path = trail.exit_path(p_W, trail_link(mission));
    const double back_s = path_time_s(mission, path.points, t);
    const double ascent_s = ascent_time_s(-path.points.back().z());
    const double energy_wh = (t + back_s) * power + ascent_s * ascent;
    if (!budget.no_return &&
        (t + back_s + ascent_s > limit.time_s || energy_wh > limit.energy_wh)) {
      budget.no_return = Budget::NoReturn{distance, state};
    }
    const double time_left = limit.time_s - entered_s;
    const double energy_left = limit.energy_wh - entered_s * power;
    const bool inward = !open && path.length_m > last_out_m;
    last_out_m = path.length_m;
    if (!inward || time_left <= 0.0 || energy_left <= 0.0) return;
    const double used =
        std::max((t - entered_s) / time_left, (t - entered_s) * power / energy_left);
    if (used <= budget.budget_used_under_overhead) return;
    budget.budget_used_under_overhead = used;
    budget.worst_overhead_state = state;
  };
  visit(route.start.p, 0.0, "start");
  for (std::size_t l = 0; l < legs.size(); ++l) {
    const std::vector<Pose>& waypoints = legs[l].plan.waypoints;
    for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
      distance += (waypoints[i + 1].p - waypoints[i].p).norm();
      visit(waypoints[i + 1].p, times.legs[l].waypoint_s[i + 1], legs[l].state);
    }
  }
}

std::vector<TurningPoint> turning_points_of(const ExitPathProof& exit_path, const Mission& mission,
                                            const MotionModel& motion,
                                            const vehicle::Conditions& conditions) {
  // Most of an exit may be the ascent.
  const double power = std::max(swimming_power(mission, motion), ascent_power(motion));
  std::vector<TurningPoint> points;
  for (const LegExit& leg : exit_path.legs) {
    points.push_back({mission.limits.mission_timeout.value - leg.longest_s,
                      mission.limits.battery_reserve.value +
                          leg.longest_s * power / conditions.battery_capacity_wh});
  }
  return points;
}

}  // namespace

std::optional<TurningPoint> Budget::first_turning_point() const {
  std::optional<TurningPoint> first;
  for (const TurningPoint& point : turning_points) {
    if (!first) first = point;
    first->latest_s = std::min(first->latest_s, point.latest_s);
    first->least_charge = std::max(first->least_charge, point.least_charge);
  }
  return first;
}

Budget make_budget(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                   const Mission& mission, const planning::World& world,
                   const vehicle::Model& model, const ExitPathProof& exit_path,
                   const vehicle::Conditions& conditions) {
  Budget budget;
  for (const PlannedRouteLeg& leg : legs) budget.distance_m += leg.plan.length_m;
  budget.duration_s = route_times(route, legs, mission).ends_s;
  budget.distance_m += route.ascent_m;
  const double power = swimming_power(mission, model.motion);
  const double ascent = ascent_power(model.motion);
  const double ascent_s = ascent_time_s(route.ascent_m);
  budget.energy_wh = power * (budget.duration_s - ascent_s) + ascent * ascent_s;
  budget.worst_duration_s = mission.limits.mission_timeout.value + exit_path.longest_s;
  budget.worst_energy_wh =
      power * mission.limits.mission_timeout.value + std::max(power, ascent) * exit_path.longest_s;
  find_turning_points(route, legs, mission, world, model, usable(mission, conditions), budget);
  budget.turning_points = turning_points_of(exit_path, mission, model.motion, conditions);
  return budget;
}

void check_budget(const Budget& budget, const ExitPathProof& exit_path, const Mission& mission,
                  const vehicle::Conditions& conditions, Diagnostics& diagnostics) {
  const Located<double>& timeout = mission.limits.mission_timeout;
  const Usable limit = usable(mission, conditions);
  if (budget.duration_s > limit.time_s) {
    diagnostics.error(
        "CHK-TIME", mission.source, timeout.span,
        fmt::format("the route takes {:.0f} s at {:g} m/s{}, longer than "
                    "mission_timeout ({:g} s)",
                    budget.duration_s, mission.speed.value,
                    mission.current.value.is_still() ? "" : " in this current", timeout.value),
        "raise mission_timeout or shorten the route");
  } else if (budget.duration_s + exit_path.longest_s > limit.time_s) {
    diagnostics.warning("CHK-TIME-MARGIN", mission.source, timeout.span,
                        fmt::format("the route takes {:.0f} s and the longest exit path {:.0f} s: "
                                    "together longer than mission_timeout",
                                    budget.duration_s, exit_path.longest_s));
  }
  if (budget.energy_wh > limit.energy_wh) {
    diagnostics.error("CHK-ENERGY", mission.source, mission.limits.battery_reserve.span,
                      fmt::format("the route takes {:.1f} Wh, and the battery has {:.1f} Wh above "
                                  "its reserve",
                                  budget.energy_wh, limit.energy_wh),
                      "shorten the route or lower battery_reserve");
  } else if (budget.no_return) {
    diagnostics.error("CHK-NO-RETURN", mission.source,
                      span_of_state(mission, budget.no_return->state),
                      fmt::format("from {:.0f} m along the route, in '{}', time or charge no "
                                  "longer suffice to leave and surface",
                                  budget.no_return->distance_m, budget.no_return->state),
                      "shorten the route, or raise mission_timeout");
  }
  const double charge = conditions.battery_capacity_wh * conditions.battery_fraction;
  if (budget.worst_energy_wh > charge) {
    diagnostics.warning(
        "CHK-ENERGY-WORST", mission.source, timeout.span,
        fmt::format("a dive until mission_timeout and the exit path take {:.1f} Wh, "
                    "and the battery has {:.1f} Wh",
                    budget.worst_energy_wh, charge),
        "lower mission_timeout");
  }
  if (budget.budget_used_under_overhead > 1.0 / 3.0) {
    diagnostics.warning(
        "CHK-THIRDS", mission.source, span_of_state(mission, budget.worst_overhead_state),
        fmt::format("{:.0f} % of the usable time or charge are used in '{}' "
                    "before the return begins, more than a third",
                    100.0 * budget.budget_used_under_overhead, budget.worst_overhead_state));
  }
}

}  // namespace dive::mission
