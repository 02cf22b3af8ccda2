// Rules about start and goals, each by itself, in the world.

#include <fmt/format.h>

#include "mission/check/check_context.h"

namespace dive::mission {
namespace {

// True if its depth depends on the map. (mission/document checks the others.)
bool is_by_altitude(const NamedGoal& goal) { return goal.position->z_units == ZUnits::kAltitude; }

}  // namespace

void positions_have_ground(CheckContext& context) {
  for (const NamedGoal& goal : context.goals()) {
    if (context.in_world(*goal.position)) continue;
    context.error("CHK-NO-GROUND", goal.position->z.span,
                  fmt::format("{} uses ALTITUDE, but there is no ground below", goal.name),
                  "give its DEPTH");
  }
  for (const TagSpec& tag : context.mission.tags) {
    if (context.in_world(tag.position)) continue;
    context.error(
        "CHK-NO-GROUND", tag.position.z.span,
        fmt::format("the tag {} uses ALTITUDE, but there is no ground below", tag.id.value),
        "give its DEPTH");
  }
}

void positions_are_in_the_water(CheckContext& context) {
  const double max_depth = context.mission.limits.max_depth.value;
  for (const NamedGoal& goal : context.goals()) {
    const auto p_W = context.in_world(*goal.position);
    if (!is_by_altitude(goal) || !p_W) continue;
    if (p_W->z() > 0.0) {
      context.error(
          "CHK-ABOVE-SURFACE", goal.position->z.span,
          fmt::format("{} is {:.2f} m above the surface: the ground is only {:.2f} m deep",
                      goal.name, p_W->z(), goal.position->z.value - p_W->z()));
    } else if (-p_W->z() > max_depth) {
      context.error("CHK-TOO-DEEP", goal.position->z.span,
                    fmt::format("{} is {:.2f} m deep, deeper than max_depth {:g} m ({})", goal.name,
                                -p_W->z(), max_depth,
                                context.mission.source.line_name(
                                    context.mission.limits.max_depth.span.line)));
    }
  }
}

void positions_are_clear(CheckContext& context) {
  const Located<double>& clearance = context.mission.limits.clearance;
  const std::vector<NamedGoal> goals = context.goals();
  // Whether a start's clearance suffices depends on the path that leaves it: see CHK-PLAN.
  const bool start_is_left = goals.size() > 1;
  for (const NamedGoal& goal : goals) {
    const auto p_W = context.in_world(*goal.position);
    if (!p_W) continue;
    const auto contact = context.nearest(*p_W, goal.heading_deg, clearance.value);
    if (!contact || contact->distance >= clearance.value) continue;
    const std::string& obstacle = context.obstacle_name(contact->obstacle);
    if (contact->distance <= 0.0) {
      context.error("CHK-INSIDE", goal.position->x.span,
                    fmt::format("{} is inside '{}'", goal.name, obstacle));
    } else if (goal.position != &context.mission.start || !start_is_left) {
      context.error(
          "CHK-CLEARANCE", goal.position->x.span,
          fmt::format("{} is {:.2f} m from '{}', nearer than the clearance of {:g} m ({})",
                      goal.name, contact->distance, obstacle, clearance.value,
                      context.mission.source.line_name(clearance.span.line)));
    }
  }
}

// Measured from the vehicle's centre, as by an altimeter.
void positions_keep_altitude(CheckContext& context) {
  const Located<double>& limit = context.mission.limits.min_altitude;
  for (const NamedGoal& goal : context.goals()) {
    const auto p_W = context.in_world(*goal.position);
    const auto floor_z = p_W ? context.ground_below(*p_W) : std::nullopt;
    if (!floor_z) continue;
    const double altitude = p_W->z() - *floor_z;
    if (altitude <= 0.0 || altitude >= limit.value) continue;  // inside an obstacle: CHK-INSIDE
    context.error("CHK-ALTITUDE", goal.position->z.span,
                  fmt::format("{} is {:.2f} m above the ground, less than min_altitude {:g} m ({})",
                              goal.name, altitude, limit.value,
                              context.mission.source.line_name(limit.span.line)));
  }
}

void overheads_are_declared(CheckContext& context) {
  for (const NamedGoal& goal : context.goals()) {
    const auto p_W = context.in_world(*goal.position);
    const int obstacle = p_W && !goal.overhead_declared ? context.overhead(*p_W) : -1;
    if (obstacle < 0) continue;
    context.warning("CHK-OVERHEAD", goal.position->x.span,
                    fmt::format("{} is under '{}', but its state does not declare the overhead",
                                goal.name, context.obstacle_name(obstacle)),
                    "write overhead=\"true\", so that an abort leads to open water first");
  }
}

}  // namespace dive::mission
