// Path optimisation on scenes whose result is known independently.

#include "planning/trajopt/trajopt.h"

#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/assert.h"
#include "test/planning/boxes.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::arbitrary_double;
using testing::box_corners;
using testing::box_to_box;
using testing::draw;
using testing::PlacedBox;
using testing::still;

const Vector3d kBodySize(0.80, 0.48, 0.22);
const RobotHull kVehicle{{{"body", box_corners(kBodySize)}}};

TrajoptProblem swim(const Vector3d& from, const Vector3d& to) {
  TrajoptProblem problem;
  problem.start = {from, heading_along(to - from)};
  problem.goal = {to, heading_along(to - from)};
  problem.limits.clearance = 1.0;
  problem.limits.attitude = AttitudeMode::kHorizontal;
  return problem;
}

TrajoptResult optimise(const World& world, const TrajoptProblem& problem,
                       std::vector<Pose> initial = {}) {
  Scene scene(world);
  Trajopt trajopt(scene, kVehicle);
  if (initial.empty()) {
    initial = straight_line(problem.start, problem.goal, problem.limits.attitude, 1.5);
  }
  return trajopt.optimise(problem, initial);
}

// Least clearance of the true motion, every 5 mm, without our distances.
double clearance_of(const std::vector<Pose>& path, const World& world) {
  double least = 1e300;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const int steps = static_cast<int>((path[i + 1].p - path[i].p).norm() / 0.005) + 1;
    for (int k = 0; k <= steps; ++k) {
      const PlacedBox body{kBodySize,
                           interpolate(path[i], path[i + 1], static_cast<double>(k) / steps)};
      for (const Obstacle& obstacle : world.obstacles) {
        const PlacedBox box{std::get<Box>(obstacle.shape).size, obstacle.X_WO};
        least = std::min(least, box_to_box(body, box));
      }
    }
  }
  return least;
}

TEST(Trajopt, StaysOnTheStraightLineInOpenWater) {
  const Vector3d from(0, 0, -5);
  const Vector3d to(9, 3, -6);
  for (const AttitudeMode mode : {AttitudeMode::kFree, AttitudeMode::kHorizontal}) {
    TrajoptProblem problem = swim(from, to);
    problem.limits.attitude = mode;
    if (mode == AttitudeMode::kHorizontal) {
      problem.start.q = problem.goal.q = heading_along(Vector3d(3, 1, 0));
    }
    const TrajoptResult result = optimise(World{}, problem);
    EXPECT_EQ(result.status, TrajoptStatus::kConverged);
    EXPECT_NEAR(result.length_m, (to - from).norm(), 1e-6);
    EXPECT_EQ(result.violation_m, 0.0);
    EXPECT_NEAR(result.merit, 100.0 * result.length_m, 1e-3);
    for (const Pose& pose : result.waypoints) {
      const double along = (pose.p - from).dot((to - from).normalized());
      EXPECT_NEAR((pose.p - from - along * (to - from).normalized()).norm(), 0.0, 1e-6);
    }
  }
}

TEST(Trajopt, StraightensABentPathInOpenWater) {
  const TrajoptProblem problem = swim({0, 0, -5}, {9, 0, -5});
  const std::vector<Vector3d> bent{{0, 0, -5}, {1, 1, -6}, {2, -1, -4}, {4, 2, -5},
                                   {7, 2, -5}, {8, 0, -7}, {9, 0, -5}};
  const auto initial = poses_along(bent, problem.start, problem.goal, problem.limits.attitude);
  const TrajoptResult result = optimise(World{}, problem, initial);
  EXPECT_EQ(result.status, TrajoptStatus::kConverged);
  EXPECT_NEAR(result.length_m, 9.0, 0.02);
}

TEST(Trajopt, IsPushedOffABoxBesideTheLineToTheClearanceAndNoFarther) {
  EXPECT_TRUE(rc::check([] {
    const double side = draw(rc::gen::arbitrary<bool>()) ? 1.0 : -1.0;
    const double beside = draw(arbitrary_double(0.8, 1.5));  // distance from the box's near face
    const double along = draw(arbitrary_double(3.0, 7.0));
    const bool below = draw(rc::gen::arbitrary<bool>());
    const Vector3d centre = below ? Vector3d(along, 0.0, -8.0 - beside - 0.5)
                                  : Vector3d(along, side * (beside + 0.5), -8.0);
    const World world{{{"box", Box{{1.0, 1.0, 1.0}}, still(centre)}}};
    const TrajoptResult result = optimise(world, swim({0, 0, -8}, {10, 0, -8}));
    RC_ASSERT(result.status == TrajoptStatus::kConverged);
    const double free = beside - (below ? 0.11 : 0.24);  // clearance of the line itself
    const double kept = clearance_of(result.waypoints, world);
    RC_ASSERT(kept >= 1.0 - 1e-6);
    // The limit includes the buffer of 0.02 m, the pad of turning, and the extra distance of two
    // waypoints that pass a box a metre wide between them.
    RC_ASSERT(kept <= std::max(free, 1.0) + 0.15);
    RC_ASSERT(result.length_m < 10.5);
  }));
}

// A path that turns back round the end of a wall saves up to 2 m of length, at 100 a metre, for
// each metre of distance to that end that it gives up. No saving exceeds a weight of 200; with half
// of that the path cuts into the clearance, with a hundredth it goes through the wall.
TEST(Trajopt, NoSavingInLengthIsWorthTheClearance) {
  const World world{{{"wall", Box{{0.2, 10.0, 30.0}}, still({0, -4.0, -10})}}};  // ends at y = 1
  for (const double beside : {1.0, 1.5, 2.0, 3.0}) {
    const std::vector<Vector3d> round{
        {-beside, -3.0, -10}, {-beside, -1.5, -10}, {-beside, 0, -10},
        {-beside, 1.5, -10},  {0, 2.5, -10},        {beside, 1.5, -10},
        {beside, 0, -10},     {beside, -1.5, -10},  {beside, -3, -10}};
    TrajoptProblem problem;
    problem.start = {round.front(), from_rpy(0, 0, M_PI / 2)};
    problem.goal = {round.back(), from_rpy(0, 0, -M_PI / 2)};
    problem.limits.attitude = AttitudeMode::kHorizontal;
    problem.limits.clearance = 0.5;
    problem.escalate_below = 0.0;  // with a constant weight
    const auto initial = poses_along(round, problem.start, problem.goal, problem.limits.attitude);
    Scene scene(world);
    const auto violation = [&](const TrajoptOptions& options) {
      return Trajopt(scene, kVehicle, options).optimise(problem, initial).violation_m;
    };
    TrajoptOptions options;
    EXPECT_EQ(violation(options), 0.0) << beside;
    options.obstacle_weight *= 0.5;
    EXPECT_GT(violation(options), 0.1) << beside;
    options.obstacle_weight = 2.0;
    EXPECT_GT(violation(options), 1.0) << beside;
  }
}

TEST(Trajopt, PaysForWhatItCannotKeepAndReportsWhere) {
  // A gate of 1.6 m: at most 0.56 m on each side.
  const World world{{{"left", Box{{0.5, 4.0, 20.0}}, still({4, 2.8, -5})},
                     {"right", Box{{0.5, 4.0, 20.0}}, still({4, -2.8, -5})}}};
  const TrajoptResult result = optimise(world, swim({0, 0, -5}, {9, 0, -5}));
  EXPECT_NEAR(result.violation_m, 1.0 - 0.56, 0.01);
  ASSERT_EQ(result.waypoint_cost.size(), result.waypoints.size());
  const auto worst = std::max_element(result.waypoint_cost.begin(), result.waypoint_cost.end());
  const auto at = static_cast<std::size_t>(worst - result.waypoint_cost.begin());
  EXPECT_NEAR(result.waypoints[at].p.x(), 4.0, 1.5);
  EXPECT_EQ(result.waypoint_cost.front() + result.waypoint_cost.back(), 0.0);
}

TEST(Trajopt, HorizontalKeepsRollAndPitchAtExactlyZero) {
  const World world{{{"box", Box{{1.0, 2.0, 1.0}}, still({4, 0.7, -8.4})}}};
  const TrajoptResult result = optimise(world, swim({0, 0, -8}, {9, -1, -6}));
  for (std::size_t i = 1; i < result.waypoints.size(); ++i) {  // the start is given
    const Vector3d up = result.waypoints[i].q * Vector3d::UnitZ();
    EXPECT_EQ(up.head<2>().norm(), 0.0) << to_rpy(result.waypoints[i].q).transpose();
  }
}

TEST(Trajopt, FreeAttitudePointsAlongTheMotion) {
  const TrajoptProblem problem = [] {
    TrajoptProblem p = swim({0, 0, -3}, {9, 0, -9});
    p.limits.attitude = AttitudeMode::kFree;
    return p;
  }();
  const auto result = optimise(World{}, problem);
  for (std::size_t i = 1; i + 1 < result.waypoints.size(); ++i) {
    const Vector3d way = result.waypoints[i + 1].p - result.waypoints[i].p;
    EXPECT_GT((result.waypoints[i].q * Vector3d::UnitX()).dot(way.normalized()), 0.999);
  }
}

// Level the vehicle is 0.48 m wide, on its side 0.22 m, and in between wider than both.
TEST(Trajopt, LiesOnItsSideInASlitThatIsTooNarrowForALevelVehicle) {
  const World world{{{"left", Box{{1.0, 4.0, 20.0}}, still({4.5, 2.32, -9})},
                     {"right", Box{{1.0, 4.0, 20.0}}, still({4.5, -2.32, -9})}}};
  TrajoptProblem problem = swim({0, 0, -8}, {9, 0, -8});
  problem.limits.clearance = 0.2;
  Scene scene(world);
  Trajopt trajopt(scene, kVehicle);
  const TrajoptResult level = optimise(world, problem);
  EXPECT_NEAR(clearance_of(level.waypoints, world), 0.08, 0.01);
  EXPECT_FALSE(trajopt.other_rolls(problem, level.waypoints)) << "horizontal leaves no choice";

  problem.limits.attitude = AttitudeMode::kFree;
  const auto rolled = trajopt.other_rolls(problem, level.waypoints);
  ASSERT_TRUE(rolled);
  const TrajoptResult on_its_side = trajopt.optimise(problem, *rolled);
  EXPECT_GE(clearance_of(on_its_side.waypoints, world), 0.2 - 1e-6);
  EXPECT_FALSE(trajopt.other_rolls(problem, on_its_side.waypoints)) << "nothing to gain";
}

TEST(Trajopt, LiesLevelAgainWhereThereIsClearance) {
  TrajoptProblem problem = swim({0, 0, -8}, {9, 0, -8});
  problem.limits.attitude = AttitudeMode::kFree;
  std::vector<Pose> initial =
      straight_line(problem.start, problem.goal, problem.limits.attitude, 1.5);
  for (std::size_t i = 1; i < initial.size(); ++i) initial[i].q = from_rpy(1.0, 0.0, 0.0);
  const TrajoptResult result = optimise(World{}, problem, initial);
  for (const Pose& pose : result.waypoints) EXPECT_NEAR(to_rpy(pose.q).x(), 0.0, 0.05);
}

TEST(Trajopt, ReachesTheGoalAndKeepsItsAttitudeWhenAsked) {
  EXPECT_TRUE(rc::check([] {
    TrajoptProblem problem = swim({0, 0, -5}, {6, 2, -6});
    problem.start.q = from_rpy(0, 0, draw(arbitrary_double(-3, 3)));
    problem.goal.q = from_rpy(0, 0, draw(arbitrary_double(-3, 3)));
    problem.goal_attitude_fixed = true;
    const TrajoptResult result = optimise(World{}, problem);
    RC_ASSERT(result.waypoints.front().p == problem.start.p);
    RC_ASSERT(result.waypoints.front().q.coeffs() == problem.start.q.coeffs());
    RC_ASSERT(result.waypoints.back().p == problem.goal.p);
    RC_ASSERT(angle_between(result.waypoints.back().q, problem.goal.q) < 1e-9);
  }));
  // If free, the goal's attitude follows the motion.
  TrajoptProblem problem = swim({0, 0, -5}, {6, 2, -5});
  problem.goal.q = from_rpy(0, 0, 2.5);
  const Pose last = optimise(World{}, problem).waypoints.back();
  EXPECT_NEAR(to_rpy(last.q).z(), std::atan2(2, 6), 0.1);
}

TEST(Trajopt, HoldsTheDepthLimits) {
  // The best path is below the obstacle, but the depth limit is above it: it must not be crossed.
  const World world{{{"bar", Box{{0.5, 30.0, 2.0}}, still({4, 0, -4.0})}}};
  TrajoptProblem problem = swim({0, 0, -6.5}, {8, 0, -6.5});
  problem.limits.min_z = -6.5;
  for (const Pose& pose : optimise(world, problem).waypoints) EXPECT_GE(pose.p.z(), -6.5);
  problem.limits.min_z = -50.0;
  EXPECT_GE(clearance_of(optimise(world, problem).waypoints, world), 1.0 - 1e-6);

  // Higher up the clearance is larger still, but the upper limit applies.
  const World floor{{{"floor", Box{{30.0, 30.0, 2.0}}, still({4, 0, -8.0})}}};
  problem.limits.max_z = -6.3;
  for (const Pose& pose : optimise(floor, problem).waypoints) EXPECT_LE(pose.p.z(), -6.3);
  problem.limits.max_z = 0.0;
  const TrajoptResult free = optimise(floor, problem);
  EXPECT_GT(free.waypoints[free.waypoints.size() / 2].p.z(), -6.0);
}

TEST(Trajopt, KeepsBelowTheSurfaceByTheClearanceWhereItCan) {
  const TrajoptProblem problem = swim({0, 0, -0.2}, {9, 0, -0.2});  // both ends are given
  const TrajoptResult result = optimise(World{}, problem);
  EXPECT_EQ(result.status, TrajoptStatus::kConverged);
  for (std::size_t i = 1; i + 1 < result.waypoints.size(); ++i) {
    EXPECT_LE(result.waypoints[i].p.z(), -1.0 + 1e-3) << i;
  }
  // Below the limit the surface has no effect.
  const TrajoptResult deep = optimise(World{}, swim({0, 0, -1.05}, {9, 0, -1.05}));
  for (const Pose& pose : deep.waypoints) EXPECT_NEAR(pose.p.z(), -1.05, 1e-6);
}

TEST(Trajopt, TheSurfaceGivesWayToAnObstacleThatLeavesNothingElse) {
  const World world{{{"reef", Box{{2.0, 40.0, 4.0}}, still({5, 0, -3.7})}}};  // top at -1.7
  const TrajoptResult result =
      optimise(world, swim({0, 0, -2.5}, {10, 0, -2.5}),
               poses_along(std::vector<Vector3d>{{0, 0, -2.5},
                                                 {1.5, 0, -1.5},
                                                 {3, 0, -0.7},
                                                 {5, 0, -0.7},
                                                 {7, 0, -0.7},
                                                 {8.5, 0, -1.5},
                                                 {10, 0, -2.5}},
                           {Vector3d(0, 0, -2.5), {1, 0, 0, 0}},
                           {Vector3d(10, 0, -2.5), {1, 0, 0, 0}}, AttitudeMode::kHorizontal));
  EXPECT_GT(clearance_of(result.waypoints, world), 0.8);
  for (const Pose& pose : result.waypoints) EXPECT_LE(pose.p.z(), 0.0);
}

// The surface cost as printed in the paper, c_z = z + eps for z > -D_min and zero below, against
// the hinge used here. See doc/decisions/surface-cost.md.
TEST(SurfaceCost, AsPrintedRewardsTheForbiddenAndJumpsWhereTheHingeDoesNot) {
  constexpr double kClearance = 0.6;
  constexpr double kEps = 0.05;
  const auto printed = [](double z) { return z > -kClearance ? z + kEps : 0.0; };
  const auto hinge = [](double z) { return std::max(0.0, z + kClearance); };
  // Just above the limit the printed cost is negative: a reward for being too high.
  EXPECT_LT(printed(-0.5), -0.4);
  EXPECT_LT(printed(-0.5), printed(-0.7));
  EXPECT_GT(hinge(-0.5), hinge(-0.7));
  // At the limit it jumps by the clearance minus eps.
  const double h = 1e-9;
  EXPECT_NEAR(printed(-kClearance + h) - printed(-kClearance - h), kEps - kClearance, 1e-6);
  EXPECT_NEAR(hinge(-kClearance + h) - hinge(-kClearance - h), 0.0, 1e-6);
  // A search over depth therefore ends above the limit.
  double best_printed = -2.0;
  double best_hinge = -2.0;
  for (double z = -2.0; z < 0.0; z += 0.001) {
    if (printed(z) < printed(best_printed)) best_printed = z;
    if (hinge(z) < hinge(best_hinge)) best_hinge = z;
  }
  EXPECT_GT(best_printed, -kClearance);
  EXPECT_LE(best_hinge, -kClearance);
}

TEST(Trajopt, SameInputSameBits) {
  const World world{{{"box", Box{{1.0, 2.0, 1.0}}, still({4, 0.7, -8.4})}}};
  const auto first = optimise(world, swim({0, 0, -8}, {9, -1, -6}));
  const auto second = optimise(world, swim({0, 0, -8}, {9, -1, -6}));
  ASSERT_EQ(first.waypoints.size(), second.waypoints.size());
  for (std::size_t i = 0; i < first.waypoints.size(); ++i) {
    EXPECT_EQ(first.waypoints[i].p, second.waypoints[i].p);
    EXPECT_EQ(first.waypoints[i].q.coeffs(), second.waypoints[i].q.coeffs());
  }
}

TEST(Trajopt, NeedsTwoPosesToStartFrom) {
  const std::vector<Pose> one{still({0, 0, -5})};
  EXPECT_THROW((void)optimise(World{}, swim({0, 0, -5}, {1, 0, -5}), one), AssertionFailure);
}

TEST(InitialPaths, StraightLineHasAWaypointPerSpacingAndAtLeastThree) {
  const TrajoptProblem problem = swim({0, 0, -5}, {4.6, 0, -5});
  const auto path = straight_line(problem.start, problem.goal, AttitudeMode::kHorizontal, 1.5);
  ASSERT_EQ(path.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(path[i].p.x(), 1.15 * static_cast<double>(i), 1e-12);
  }
  const auto short_path =
      straight_line(problem.start, still({0.1, 0, -5}), AttitudeMode::kHorizontal, 1.5);
  EXPECT_EQ(short_path.size(), 3U);
}

TEST(InitialPaths, PosesFollowThePolylineAndKeepTheEnds) {
  const std::vector<Vector3d> corner{{0, 0, -5}, {2, 0, -5}, {2, 2, -7}};
  const Pose start{corner.front(), from_rpy(0.2, 0.1, 3.0)};
  const Pose goal = still(corner.back());
  const auto level = poses_along(corner, start, goal, AttitudeMode::kHorizontal);
  EXPECT_EQ(level[0].q.coeffs(), start.q.coeffs());
  EXPECT_NEAR(to_rpy(level[1].q).z(), M_PI / 4, 1e-12);
  EXPECT_NEAR(to_rpy(level[1].q).y(), 0.0, 1e-12);
  EXPECT_NEAR(to_rpy(level[2].q).z(), M_PI / 2, 1e-12);
  const auto free = poses_along(corner, start, goal, AttitudeMode::kFree);
  EXPECT_GT((free[2].q * Vector3d::UnitX()).dot(Vector3d(0, 1, -1).normalized()), 1.0 - 1e-12);
}

}  // namespace
}  // namespace dive::planning
