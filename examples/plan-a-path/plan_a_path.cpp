// Plans the Aqua2 a path in a map (SDF) and prints its waypoints and certified clearance.
#include <fmt/format.h>

#include "planning/planner.h"
#include "planning/world/sdf.h"
#include "vehicle/model.h"

int main(int, char** arguments) {
  dive::Diagnostics diagnostics;
  const auto world = dive::planning::load_sdf(arguments[1], diagnostics);
  const auto aqua2 = dive::vehicle::parse_urdf(dive::vehicle::aqua2_urdf(), diagnostics);
  if (!world || !aqua2) return 2;
  dive::SteadyClock clock;
  dive::planning::Planner planner(*world, aqua2->hull, {}, clock);
  dive::planning::PlanRequest request;
  request.start.p = {-1.0, -2.0, -4.0};
  request.goal.p = {9.8, -2.0, -4.6};
  const dive::planning::PlanResult plan = planner.plan(request);
  for (const dive::Pose& pose : plan.waypoints) fmt::print("{:6.2f}\n", fmt::join(pose.p, " "));
  fmt::print("{}: {:.1f} m, clearance {:.2f} m\n", to_string(plan.status), plan.length_m,
             plan.clearance_m);
  return plan.accepted ? 0 : 1;
}
