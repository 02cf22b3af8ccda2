// Paths that a request gives the planner to begin with.

#include <vector>

#include <gtest/gtest.h>

#include "test/planning/planner/planner_sample.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::still;

TEST(Planner, StartsFromAGivenPath) {
  const World world = window();
  PlanRequest request = ask(kGate, kRoomB, 1.0);
  const PlanResult first = plan(world, request);
  ASSERT_EQ(first.status, PlanStatus::kSuccess);
  request.start = first.waypoints[2];
  request.start.p += Vector3d(0.1, -0.1, 0.05);
  request.previous = {first.waypoints.begin() + 2, first.waypoints.end()};
  const PlanResult next = plan(world, request);
  ASSERT_EQ(next.status, PlanStatus::kSuccess) << next.reason;
  EXPECT_EQ(next.warm_starts, 0) << "it already goes through the window";
  EXPECT_EQ(next.waypoints.front().p, request.start.p);
}

// Back through the window by the way that it has come, whatever the seed.
TEST(Planner, TriesTheTrailWhereTheDirectPathFails) {
  const World world = window();
  const PlanResult in = plan(world, ask(kGate, kRoomB, 1.0));
  ASSERT_EQ(in.status, PlanStatus::kSuccess);
  PlanRequest request = ask(kRoomB, kGate, 1.0);
  ASSERT_GE(plan(world, request).warm_starts, 1);
  for (auto pose = in.waypoints.rbegin(); pose != in.waypoints.rend(); ++pose) {
    request.trail.push_back(still(pose->p));
  }
  const PlanResult out = plan(world, request);
  ASSERT_EQ(out.status, PlanStatus::kSuccess) << out.reason;
  EXPECT_EQ(out.warm_starts, 0);
  EXPECT_LT(out.length_m, 1.02 * in.length_m);
  EXPECT_EQ(out.waypoints.back().p, kGate);

  PlanRequest direct = ask({0, 0, -4}, {9, 0, -4}, 0.6);
  direct.trail = {still({0, 0, -4}), still({4, 3, -4}), still({9, 0, -4})};
  EXPECT_NEAR(plan({}, direct).length_m, 9.0, 0.01) << "no trail where the direct path is free";
}

// Round a plate to a goal that is nearer than a segment is long.
TEST(Planner, TakesATrailOfAnyLength) {
  World world;
  world.obstacles.push_back({"plate", Box{{2.0, 0.02, 8}}, Pose{{0, 0.95, -4}, {}}});
  PlanRequest request = ask({0, 0, -4}, {0, 1.9, -4}, 0.2);
  PlannerOptions options;
  options.waypoint_spacing_m = 4.0;
  for (const double spacing : {0.01, 0.5, 3.0}) {
    request.trail.clear();
    const std::vector<Vector3d> corners = {{0, 0, -4}, {-2, 0, -4}, {-2, 1.9, -4}, {0, 1.9, -4}};
    for (std::size_t i = 1; i < corners.size(); ++i) {
      const Vector3d way = corners[i] - corners[i - 1];
      for (double s = 0.0; s < way.norm(); s += spacing) {
        request.trail.push_back(still(corners[i - 1] + s * way.normalized()));
      }
    }
    request.trail.push_back(still(request.goal.p));
    const PlanResult result = plan(world, request, kVehicle, options);
    EXPECT_EQ(result.status, PlanStatus::kSuccess) << spacing << ": " << result.reason;
  }
}

TEST(Planner, WarmStartsWhereTheTrailIsBlocked) {
  PlanRequest request = ask(kRoomB, kGate, 1.0);
  request.trail = {still(kRoomB), still(0.5 * (kRoomB + kGate)), still(kGate)};
  const PlanResult result = plan(window(), request);
  EXPECT_EQ(result.status, PlanStatus::kSuccess) << result.reason;
  EXPECT_GE(result.warm_starts, 1);
}

}  // namespace
}  // namespace dive::planning
