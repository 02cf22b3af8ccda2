#include "mission/check/current_check.h"

#include <cmath>

#include <fmt/format.h>

#include "common/se3.h"
#include "planning/world/overhead.h"
#include "vehicle/follower.h"

namespace dive::mission {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double compass_deg(const Vector2d& velocity_W) {
  return compass_heading_deg(rad_to_deg(std::atan2(velocity_W.x(), velocity_W.y())));
}

std::string describe(const Vector2d& current_W, double sigma) {
  std::string text =
      fmt::format("{:.2f} m/s towards {:.0f} degrees", current_W.norm(), compass_deg(current_W));
  if (sigma > 0.0) text += fmt::format(", with a sigma of {:g} m/s", sigma);
  return text;
}

LeastProgress progress_along(const Vector3d& direction, double speed, const Vector2d& current_W,
                             double sigma) {
  const Vector3d current(current_W.x(), current_W.y(), 0.0);
  const double along = direction.dot(current) - sigma;
  const double across = (current - direction.dot(current) * direction).norm() + sigma;
  LeastProgress progress;
  if (across >= speed) {
    progress.share = 0.0;
    progress.crab_rad = 0.5 * M_PI;
    return progress;
  }
  progress.over_ground = along + std::sqrt(speed * speed - across * across);
  progress.share = progress.over_ground / speed;
  progress.crab_rad = std::asin(across / speed);
  return progress;
}

bool is_too_strong(const LeastProgress& progress) {
  return progress.share < kLeastProgress || progress.crab_rad > vehicle::kMaxCrab;
}

// The worse of two: what is too strong first, then the slower.
bool is_worse(const LeastProgress& a, const LeastProgress& b) {
  const bool a_refused = is_too_strong(a);
  return a_refused != is_too_strong(b) ? a_refused : a.share < b.share;
}

std::string what_is_left(const LeastProgress& progress, double speed) {
  if (progress.crab_rad >= 0.5 * M_PI) {
    return fmt::format("across the path it is faster than the vehicle with its {:g} m/s", speed);
  }
  const bool is_error = is_too_strong(progress);
  if (is_error && progress.share >= kLeastProgress) {
    return fmt::format("across the path it needs a crab angle of {:.0f} degrees, more than {:.0f}",
                       rad_to_deg(progress.crab_rad), rad_to_deg(vehicle::kMaxCrab));
  }
  return fmt::format("{:.2f} m/s over ground are left of {:g} m/s, less than {:.0f} %",
                     progress.over_ground, speed,
                     100.0 * (is_error ? kLeastProgress : kSlowProgress));
}

std::string remedy(const LeastProgress& progress) {
  const std::string remedy =
      "raise the vehicle's speed, dive in slack water (another start in the table), or ";
  return remedy + (progress.is_way_back ? "enter where the way back is not against the current"
                                        : "lay the leg along the current");
}

void report(const RouteLeg& leg, const LeastProgress& progress, const Mission& mission,
            Diagnostics& diagnostics) {
  const Vector3d& p = progress.place_W;
  const bool is_error = is_too_strong(progress);
  if (!is_error && progress.share >= kSlowProgress) return;
  const std::string where =
      fmt::format("{} '{}', at ({:.1f}, {:.1f}, {:.1f}) after {:.0f} s, the current is {}",
                  progress.is_way_back ? "on the way back from" : "on the way to", leg.goal.id,
                  p.x(), p.y(), p.z(), progress.elapsed_s,
                  describe(mission.current.value.at(progress.elapsed_s), mission.priors.current));
  const std::string message = where + ": " + what_is_left(progress, mission.speed.value);
  if (is_error) {
    diagnostics.error("CHK-CURRENT", mission.source, leg.span, message, remedy(progress));
  } else {
    diagnostics.warning("CHK-CURRENT-MARGIN", mission.source, leg.span, message, remedy(progress));
  }
}

void check_table(const RouteTimes& times, const Mission& mission, Diagnostics& diagnostics) {
  const DeclaredCurrent& current = mission.current.value;
  if (current.covers(0.0, times.ends_s)) return;
  const double first_s = current.samples().front().elapsed_s;
  const double last_s = current.samples().back().elapsed_s;
  const std::string covered = fmt::format(
      "the table of the current holds from {:.0f} s to {:.0f} s of the mission, and the "
      "route takes from 0 s to {:.0f} s",
      first_s, last_s, times.ends_s);
  diagnostics.error("CHK-CURRENT-TABLE", mission.source, mission.current.span, covered,
                    first_s > 0.0 ? "add earlier rows to the table, or state another start"
                                  : "add later rows to the table, or state another start");
}

// Without way on the vehicle is carried with the water.
void check_drift(const RouteLeg& leg, const LegTimes& times, const Mission& mission,
                 Diagnostics& diagnostics) {
  const double limit = mission.limits.clearance.value;
  const auto report = [&](const char* what, double from_s, double rest_s) {
    const Vector2d current_W = mission.current.value.at(from_s);
    const double drift_m = current_W.norm() * rest_s;
    if (drift_m <= limit) return;
    diagnostics.warning(
        "CHK-CURRENT-DRIFT", mission.source, leg.span,
        fmt::format("in the {:g} s of the {} '{}' a current of {} carries the vehicle by {:.1f} m, "
                    "more than the clearance of {:g} m",
                    rest_s, what, leg.goal.id, describe(current_W, 0.0), drift_m, limit),
        "shorten it, or place it where that distance downstream is free");
  };
  report("hold before", times.begins_s - leg.before.rest_s, leg.before.rest_s);
  report("dwell at", times.arrives_s, leg.goal.dwell_s);
}

}  // namespace

std::vector<std::optional<LeastProgress>> least_progress(const Route& route,
                                                         const std::vector<PlannedRouteLeg>& legs,
                                                         const Mission& mission,
                                                         const planning::World& world,
                                                         double radius) {
  planning::OverheadIndex overheads(world);
  const RouteTimes times = route_times(route, legs, mission);
  std::vector<std::optional<LeastProgress>> result(legs.size());
  for (std::size_t l = 0; l < legs.size(); ++l) {
    const std::vector<Pose>& path = legs[l].plan.waypoints;
    const auto add = [&](std::size_t i, const Vector3d& direction, bool is_way_back) {
      const double t = times.legs[l].waypoint_s[i];
      LeastProgress progress = progress_along(direction, mission.speed.value,
                                              mission.current.value.at(t), mission.priors.current);
      progress.elapsed_s = t;
      progress.place_W = path[i].p;
      progress.is_way_back = is_way_back;
      if (!result[l] || is_worse(progress, *result[l])) result[l] = progress;
    };
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const Vector3d motion = path[i + 1].p - path[i].p;
      if (motion.norm() <= 0.0) continue;
      add(i, motion.normalized(), false);
      if (overheads.is_above(path[i + 1].p, radius)) add(i, -motion.normalized(), true);
    }
  }
  return result;
}

void check_current(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                   const std::vector<std::optional<LeastProgress>>& progress,
                   const Mission& mission, Diagnostics& diagnostics) {
  const RouteTimes times = route_times(route, legs, mission);
  check_table(times, mission, diagnostics);
  for (std::size_t l = 0; l < legs.size(); ++l) {
    if (progress[l]) report(route.legs[l], *progress[l], mission, diagnostics);
    check_drift(route.legs[l], times.legs[l], mission, diagnostics);
  }
}

}  // namespace dive::mission
