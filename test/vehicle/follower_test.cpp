#include "vehicle/follower.h"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "common/assert.h"
#include "test/common/allocations.h"
#include "test/common/arbitrary.h"
#include "test/vehicle/aqua2.h"
#include "vehicle/autopilot.h"

namespace dive::vehicle {
namespace {

using Eigen::Vector3d;
using testing::aqua2;
using testing::distance_to_polyline;
using testing::level_path;
using testing::turtle;

// A path swum in the simulator with perfect position and velocity estimates.
struct Swim {
  double worst_m = 0.0;        // true distance to the path
  double worst_depth_m = 0.0;  // depth against commanded depth
  double seconds = 0.0;
  Pose end;
  FollowerStatus status;
};

Swim swim(const std::vector<Pose>& path, const Conditions& conditions = testing::ideal(),
          const FollowerOptions& options = {}) {
  Simulator sim(aqua2(), path.front(), conditions, 1);
  Autopilot autopilot{AutopilotOptions{}};
  Follower follower{options};
  follower.set_path(path, path.front().p);
  PseudoRates rates;
  Swim result;
  while (!follower.status().finished && result.seconds < 200.0) {
    const SensorSamples samples = sim.step(rates);
    const GroundTruth& truth = sim.truth();
    const Command command =
        follower.step(truth.X_WB, truth.v_WB_B, conditions.declared_current.at(0.0));
    rates = autopilot.step(command, samples.imu ? samples.imu->q_WB : truth.X_WB.q,
                           truth.omega_WB_B, -truth.X_WB.p.z(), Simulator::kTick);
    result.worst_m = std::max(result.worst_m, distance_to_polyline(path, truth.X_WB.p));
    result.worst_depth_m = std::max(result.worst_depth_m, std::abs(command.d + truth.X_WB.p.z()));
    result.seconds += Simulator::kTick;
  }
  result.end = sim.truth().X_WB;
  result.status = follower.status();
  return result;
}

struct Course {
  std::string name;
  std::vector<Vector3d> points;
  double worst_m;
};
void PrintTo(const Course& course, std::ostream* out) { *out << course.name; }

class Following : public ::testing::TestWithParam<Course> {};

TEST_P(Following, StaysNearThePathAndArrives) {
  const Swim result = swim(level_path(GetParam().points));
  EXPECT_TRUE(result.status.finished);
  EXPECT_FALSE(result.status.missed);
  EXPECT_LT(result.worst_m, GetParam().worst_m);
  EXPECT_LT((result.end.p - GetParam().points.back()).norm(), 0.1);
}

INSTANTIATE_TEST_SUITE_P(
    Courses, Following,
    ::testing::Values(
        Course{"s_curve", testing::s_curve(), 0.12},
        Course{"zigzag", turtle({0, 0, -4}, {0, 40, -40, 40, -40, 40, -40, 40, -40, 0}, 0.0), 0.12},
        Course{"circle", turtle({0, 0, -4}, std::vector<double>(12, 30.0), 0.0), 0.12},
        Course{"descent", turtle({0, 0, -3}, std::vector<double>(5, 0.0), 1.0 / 3.0), 0.12},
        Course{"square_corner", turtle({0, 0, -4}, {0, 0, 90, 0, 0}, 0.0), 0.2},
        Course{"straight_down", {{0, 0, -4}, {0, 0, -5.5}, {0, 0, -7}, {2, 0, -7}}, 0.12}));

TEST(Follower, SwimsAlongAPathThatPitchesWithTheMotion) {
  const std::vector<Vector3d> points{{0, 0, -4},     {1.2, 0, -5}, {2.4, 0, -6},  {3.6, 0.3, -6},
                                     {4.8, 0.6, -5}, {6, 0.6, -4}, {7.5, 0.6, -4}};
  std::vector<Pose> path = level_path(points);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    path[i].q = heading_along(points[i + 1] - points[i]);
  }
  const Swim result = swim(path);
  EXPECT_FALSE(result.status.missed);
  EXPECT_LT(result.worst_m, 0.12);
}

TEST(Follower, SwimsOnItsSideThroughASlit) {
  std::vector<Pose> path = level_path({{0, 0, -4}, {2, 0, -4}, {4, 0, -4}, {6, 0, -4}});
  for (Pose& pose : path) pose.q = from_rpy(deg_to_rad(90.0), 0.0, 0.0);
  const Swim result = swim(path);
  EXPECT_FALSE(result.status.missed);
  EXPECT_LT(result.worst_m, 0.12);
  EXPECT_GT(std::abs(to_rpy(result.end.q).x()), deg_to_rad(80.0));
}

TEST(Follower, CrabsAcrossAnEstimatedCurrent) {
  Conditions conditions = testing::ideal();
  conditions.current_W = {0.0, 0.1, 0.0};
  EXPECT_LT(swim(level_path(testing::s_curve()), conditions).worst_m, 0.15);
}

// The speed of arrival, 0.15 m/s, is less than the current.
TEST(Follower, ArrivesAgainstAKnownHeadCurrent) {
  Conditions against = testing::ideal();
  against.declared_current = DeclaredCurrent(Eigen::Vector2d(-0.2, 0.0));
  const Swim known = swim(level_path({{0, 0, -4}, {6, 0, -4}, {12, 0, -4}}), against);
  EXPECT_TRUE(known.status.finished);
  EXPECT_LT(known.seconds, 80.0) << "12 m at 0.2 m/s over ground";
}

TEST(Follower, SlowsDownWhereDepthCannotKeepUp) {
  const Swim steep = swim(level_path({{0, 0, -3}, {1.0, 0, -5.0}, {3.0, 0, -5.0}}));
  EXPECT_LT(steep.worst_m, 0.15);
  EXPECT_FALSE(steep.status.missed);
}

// --- the law alone, without a vehicle ---

Pose level_at(double x, double y, double z, double yaw = 0.0) {
  return {{x, y, z}, from_rpy(0.0, 0.0, yaw)};
}

Follower follower_on(const std::vector<Pose>& path, const FollowerOptions& options = {}) {
  Follower follower{options};
  follower.set_path(path, path.front().p);
  return follower;
}

// The law as printed in the paper: d = z_{i-1} + (1 - z_c / z_{i-1}) (z_i - z_{i-1}). It is
// homogeneous in z, so that it is the same in depths and in heights.
double printed_depth_law(double z_start, double z_goal, double z_c) {
  return z_start + (1.0 - z_c / z_start) * (z_goal - z_start);
}

RC_GTEST_PROP(DepthLaw, LeavesItsStartWhichIsAFixedPointOfThePrintedOne, ()) {
  const double z_start = *testing::arbitrary_double(-9.0, -1.0);
  const double z_goal = *testing::arbitrary_double(-9.0, -1.0);
  RC_ASSERT(printed_depth_law(z_start, z_goal, z_start) == z_start);
  Follower follower = follower_on({level_at(0, 0, z_start), level_at(30, 0, z_goal)});
  const double d = follower.step(level_at(15, 0, z_start), {0.4, 0, 0}).d;
  RC_ASSERT(std::abs(d + 0.5 * (z_start + z_goal)) < 1e-9);
}

TEST(DepthLaw, DivesToItsGoalWhereThePrintedOneReturnsToItsStart) {
  Follower follower = follower_on({level_at(0, 0, -1), level_at(6, 0, -4)});
  double printed_z = -1.5;  // already half a metre from the start
  double z = -1.0;
  for (double x = 0.0; x < 6.0; x += 0.008) {  // 0.4 m/s at 50 Hz; depth follows within a second
    printed_z += 0.02 * (printed_depth_law(-1.0, -4.0, printed_z) - printed_z);
    const Command command = follower.step(level_at(x, 0, z), {0.4, 0, 0});
    z += 0.02 * (-command.d - z);
  }
  EXPECT_NEAR(printed_z, -1.0, 1e-3) << "d - z_c = (z_i / z_{i-1}) (z_{i-1} - z_c)";
  EXPECT_NEAR(z, -4.0, 0.4);
}

TEST(DepthLaw, LeavesTheSurfaceWhereThePrintedOneIsSingular) {
  for (const double z_c : {0.0, -0.1, -2.0}) {
    EXPECT_FALSE(std::isfinite(printed_depth_law(0.0, -4.0, z_c))) << z_c;
  }
  Follower sloped = follower_on({level_at(0, 0, 0), level_at(6, 0, -4)});
  EXPECT_NEAR(sloped.step(level_at(0, 0, 0), {0.4, 0, 0}).d, 0.0, 1e-9);
  EXPECT_NEAR(sloped.step(level_at(3, 0, 0), {0.4, 0, 0}).d, 2.0, 1e-9);
  Follower down = follower_on({level_at(0, 0, 0), level_at(0, 0, -2)});
  EXPECT_GT(down.step(level_at(0, 0, 0), Vector3d::Zero()).d, 0.2);
}

RC_GTEST_PROP(DepthLaw, IsLinearInProgressAndNeverLeavesTheSegment, ()) {
  const double z0 = *testing::arbitrary_double(-9.0, -1.0);
  const double z1 = z0 + *testing::arbitrary_double(-0.3, 0.3);
  const double x = *testing::arbitrary_double(-1.0, 3.9);
  Follower follower = follower_on({level_at(0, 0, z0), level_at(4, 0, z1)});
  const double t = std::clamp(x / 4.0, 0.0, 1.0);
  const double d = follower.step(level_at(x, 0.0, z0 + t * (z1 - z0)), {0.4, 0, 0}).d;
  RC_ASSERT(d >= -std::max(z0, z1) - 1e-12 && d <= -std::min(z0, z1) + 1e-12);
  RC_ASSERT(std::abs(d + z0 + t * (z1 - z0)) < 0.02);
}

TEST(Steering, LeadsBackToTheLineAndTakesTheSideslipOff) {
  Follower follower = follower_on({level_at(0, 0, -4), level_at(9, 0, -4)});
  const double left = to_rpy(follower.step(level_at(2, -0.5, -4), {0.4, 0, 0}).o).z();
  EXPECT_NEAR(left, std::atan2(0.5, FollowerOptions{}.lookahead_m), 1e-9);
  const double right = to_rpy(follower.step(level_at(2.1, 0.5, -4), {0.4, 0, 0}).o).z();
  EXPECT_NEAR(right, -left, 1e-9);
  const double crab = to_rpy(follower.step(level_at(2.2, 0, -4), {0.4, 0.1, 0}).o).z();
  EXPECT_NEAR(crab, -std::atan2(0.1, 0.4), 1e-9);
}

TEST(Steering, TakesRollAndPitchFromThePlan) {
  const std::vector<Pose> path{{{0, 0, -4}, from_rpy(0.0, 0.2, 0.3)},
                               {{4, 0, -4}, from_rpy(0.4, 0.2, 0.3)}};
  Follower follower = follower_on(path);
  const Vector3d rpy = to_rpy(follower.step(level_at(2, 0, -4), {0.4, 0, 0}).o);
  EXPECT_NEAR(rpy.x(), 0.2, 0.01);
  EXPECT_NEAR(rpy.y(), 0.2, 0.01);
  EXPECT_NEAR(rpy.z(), 0.0, 1e-9) << "but yaw from the line of sight";
}

TEST(Speed, FallsWithHeadingErrorCornerDepthErrorAndArrival) {
  const std::vector<Pose> path = level_path({{0, 0, -4}, {6, 0, -4}, {6, 6, -4}});
  const auto speed = [&path](const Pose& pose) {
    return follower_on(path).step(pose, {0.4, 0, 0}).v;
  };
  EXPECT_NEAR(speed(level_at(2, 0, -4)), 0.4, 1e-9);
  EXPECT_LT(speed(level_at(2, 0, -4, 1.5)), 0.1);
  EXPECT_LT(speed(level_at(5.9, 0, -4)), 0.3);
  EXPECT_LT(speed(level_at(2, 0, -3.75)), 0.2);
  EXPECT_GT(speed(level_at(2, 0, 0)), 0.0) << "steering needs some way on";
  Follower at_the_end{FollowerOptions{}};
  at_the_end.set_path(path, {6, 5.8, -4});
  EXPECT_LT(at_the_end.step(level_at(6, 5.8, -4, M_PI / 2), {0.4, 0, 0}).v, 0.3);
}

TEST(Speed, BeforeTheEndIsOverGroundAgainstAKnownCurrent) {
  const auto speed = [](double current) {
    Follower follower{FollowerOptions{}};
    follower.set_path(level_path({{0, 0, -4}, {6, 0, -4}}), {5.7, 0, -4});
    return follower.step(level_at(5.7, 0, -4), {0.4, 0, 0}, {current, 0.0}).v;
  };
  EXPECT_NEAR(speed(0.0), 0.3, 1e-9);
  EXPECT_NEAR(speed(-0.05), 0.35, 1e-9);
  EXPECT_NEAR(speed(-0.2), 0.4, 1e-9) << "the full speed through the water is the bound";
  EXPECT_NEAR(speed(0.2), 0.3, 1e-9) << "steering needs way through the water";
}

TEST(Reached, NeedsThePassedMinimumInsideTheRadius) {
  Follower follower = follower_on(level_path({{0, 0, -4}, {3, 0, -4}, {3, 3, -4}}));
  static_cast<void>(follower.step(level_at(2.7, 0.2, -4), {0.4, 0, 0}));
  EXPECT_EQ(follower.status().segment, 1) << "near, but getting nearer";
  static_cast<void>(follower.step(level_at(2.9, 0.25, -4), {0.4, 0, 0}));
  EXPECT_EQ(follower.status().segment, 1);
  static_cast<void>(follower.step(level_at(2.95, 0.4, -4), {0.4, 0, 0}));
  EXPECT_EQ(follower.status().segment, 2) << "before the plane, but past the minimum";
}

TEST(Reached, APassedPlaneIsEnoughAndDetectsAMissAtTheEnd) {
  Follower follower = follower_on(level_path({{0, 0, -4}, {3, 0, -4}, {6, 0, -4}}));
  static_cast<void>(follower.step(level_at(3.1, 2.0, -4), {0.4, 0, 0}));
  EXPECT_EQ(follower.status().segment, 2);
  EXPECT_FALSE(follower.status().finished);
  static_cast<void>(follower.step(level_at(6.1, 0.7, -4), {0.4, 0, 0}));
  EXPECT_TRUE(follower.status().finished);
  EXPECT_TRUE(follower.status().missed);
}

TEST(Reached, TheLastWaypointMayBeTighter) {
  FollowerOptions options;
  const std::vector<Pose> path = level_path({{0, 0, -4}, {3, 0, -4}});
  Follower loose = follower_on(path, options);
  static_cast<void>(loose.step(level_at(3.01, 0.3, -4), {0.4, 0, 0}));
  EXPECT_TRUE(loose.status().finished && !loose.status().missed);
  options.last_capture_radius = 0.2;
  Follower tight = follower_on(path, options);
  static_cast<void>(tight.step(level_at(3.01, 0.3, -4), {0.4, 0, 0}));
  EXPECT_TRUE(tight.status().finished && tight.status().missed);
}

TEST(Status, IsThePapersErrorAndTheDistanceToGo) {
  Follower follower = follower_on(level_path({{0, 0, -4}, {4, 0, -4}, {4, 3, -4}}));
  static_cast<void>(follower.step(level_at(1.0, 0.3, -4.4), {0.4, 0, 0}));
  EXPECT_NEAR(follower.status().cross_track_m, 0.5, 1e-9);
  EXPECT_NEAR(follower.status().along_track_m, 1.0, 1e-9);
  EXPECT_NEAR(follower.status().distance_to_go_m, 6.0, 1e-9);
}

TEST(SetPath, StartsOnTheNearestSegmentAndForgetsTheLastPath) {
  const std::vector<Pose> path = level_path({{0, 0, -4}, {3, 0, -4}, {3, 3, -4}, {0, 3, -4}});
  Follower follower{FollowerOptions{}};
  EXPECT_FALSE(follower.has_path());
  EXPECT_THROW(static_cast<void>(follower.step(Pose{}, Vector3d::Zero())), AssertionFailure);
  follower.set_path(path, {1.5, 2.9, -4});
  EXPECT_EQ(follower.status().segment, 3);
  static_cast<void>(follower.step(level_at(-0.1, 3, -4), {0.4, 0, 0}));
  EXPECT_TRUE(follower.status().finished);
  follower.set_path(path, path.front().p);
  EXPECT_FALSE(follower.status().finished);
  EXPECT_EQ(follower.status().segment, 1);
}

TEST(SetPath, RefusesWhatIsNoPath) {
  Follower follower{FollowerOptions{}};
  const std::vector<Pose> one{level_at(0, 0, -4)};
  EXPECT_THROW(follower.set_path(one, Vector3d::Zero()), AssertionFailure);
  std::vector<Pose> infinite{level_at(0, 0, -4), level_at(1, 0, -4)};
  infinite[1].p.x() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(follower.set_path(infinite, Vector3d::Zero()), AssertionFailure);
  FollowerOptions options;
  options.lookahead_m = std::nan("");
  EXPECT_THAT(options.validate(), ::testing::StartsWith("lookahead_m"));
}

RC_GTEST_PROP(Follower, CommandsSomethingSaneOnAnyPathFromAnywhere, ()) {
  const auto count = *rc::gen::inRange<std::size_t>(2, 8);
  std::vector<Pose> path;
  for (std::size_t i = 0; i < count; ++i) path.push_back(*testing::arbitrary_pose());
  if (*rc::gen::arbitrary<bool>()) path.push_back(path.back());  // a segment of zero length
  Follower follower = follower_on(path);
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const Pose& pose : path) {
    lowest = std::min(lowest, pose.p.z());
    highest = std::max(highest, pose.p.z());
  }
  for (int i = 0; i < 20; ++i) {
    const Command command =
        follower.step(*testing::arbitrary_pose(), *testing::arbitrary_vector(1.0));
    RC_ASSERT(command.v >= 0.0 && command.v <= FollowerOptions{}.speed);
    RC_ASSERT(command.h == 0.0);
    RC_ASSERT(-command.d >= lowest - 1e-9 && -command.d <= highest + 1e-9);
    RC_ASSERT(std::abs(command.o.norm() - 1.0) < 1e-9);
    RC_ASSERT(follower.status().segment >= 1);
    RC_ASSERT(static_cast<std::size_t>(follower.status().segment) < path.size());
  }
}

TEST(Follower, AllocatesNothingPerStep) {
  Follower follower = follower_on(level_path(testing::s_curve()));
  testing::reset_allocations();
  for (double x = -1.0; x < 3.0; x += 0.01) {
    static_cast<void>(follower.step(level_at(x, -2.0, -4.0), {0.4, 0, 0}));
  }
  EXPECT_EQ(testing::allocations().count, 0U);
}

}  // namespace
}  // namespace dive::vehicle
