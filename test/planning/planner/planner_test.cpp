// The planner on the Window environment and on scenes whose answer is known.

#include "planning/planner.h"

#include <limits>
#include <numeric>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "planning/world/sdf.h"
#include "test/common/arbitrary.h"
#include "test/planning/boxes.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::box_corners;
using testing::box_to_box;
using testing::PlacedBox;
using testing::still;

const Vector3d kBodySize(0.80, 0.48, 0.22);
const RobotHull kVehicle{{{"body", box_corners(kBodySize)}}};
const Vector3d kGate(-1.0, -2.0, -4.0);
const Vector3d kRoomB(9.8, -2.0, -4.6);

World window() {
  Diagnostics diagnostics;
  return load_sdf(DIVE_SOURCE_DIR "/missions/maps/window.sdf", diagnostics).value_or(World{});
}

PlanRequest ask(const Vector3d& from, const Vector3d& to, double clearance) {
  PlanRequest request;
  request.start = still(from);
  request.goal = still(to);
  request.clearance = clearance;
  request.attitude = AttitudeMode::kHorizontal;
  return request;
}

PlanResult plan(const World& world, const PlanRequest& request, PlannerOptions options = {}) {
  SteadyClock clock;
  return Planner(world, kVehicle, options, clock).plan(request);
}

// Along the true motion in steps of `step` metres, from the boxes' features: no distance of ours.
double clearance_of(const std::vector<Pose>& path, const World& world, double step) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const int steps = static_cast<int>((path[i + 1].p - path[i].p).norm() / step) + 1;
    for (int k = 0; k <= steps; ++k) {
      const PlacedBox body{kBodySize,
                           interpolate(path[i], path[i + 1], static_cast<double>(k) / steps)};
      for (const Obstacle& obstacle : world.obstacles) {
        const PlacedBox box{std::get<Box>(obstacle.shape).size, obstacle.X_WO};
        if (point_to_box(body.X_W.p, box) > least + 0.5) continue;  // the body's radius
        least = std::min(least, box_to_box(body, box));
      }
    }
  }
  return least;
}

TEST(Planner, FindsTheWindowWithEverySeedAndKeepsWhatItCertifies) {
  const World world = window();
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    PlanRequest request = ask(kGate, kRoomB, 1.0);
    request.seed = seed;
    const PlanResult result = plan(world, request);
    ASSERT_EQ(result.status, PlanStatus::kSuccess) << seed << ": " << result.reason;
    EXPECT_GE(result.warm_starts, 1) << "the straight line ends in a local minimum";
    EXPECT_GE(result.clearance_m, 1.0 - 1e-6);
    EXPECT_LT(result.length_m, 14.5) << seed;
    EXPECT_EQ(result.waypoints.front().p, kGate);
    EXPECT_EQ(result.waypoints.back().p, kRoomB);
    if (seed % 10 == 0) {
      EXPECT_GE(clearance_of(result.waypoints, world, 0.05), result.clearance_m - 1e-9) << seed;
    }
  }
}

// Boxes at random: whatever comes back as a success keeps what it says, and mostly one comes back.
TEST(Planner, NeverHandsOnAPathThatIsNotWhatItClaims) {
  int solved = 0;
  EXPECT_TRUE(rc::check([&] {
    World world;
    const int count = testing::draw(rc::gen::inRange(1, 12));
    for (int i = 0; i < count; ++i) {
      const Pose pose = testing::draw(testing::arbitrary_pose());
      const Vector3d at(5.0 + pose.p.x(), 0.5 * pose.p.y(), -8.0 + 0.5 * pose.p.z());
      world.obstacles.push_back({"box" + std::to_string(i),
                                 Box{testing::draw(testing::arbitrary_lengths())},
                                 Pose{at, pose.q}});
    }
    const Vector3d from(-6, 0, -8);
    if (clearance_of({still(from), still(from)}, world, 1.0) < 0.41) return;  // see LetsAVehicleOut
    const PlanResult result = plan(world, ask(from, {16, 0, -8}, 0.4));
    if (result.status != PlanStatus::kSuccess) return;
    ++solved;
    RC_ASSERT(result.clearance_m >= 0.4 - 1e-6);
    RC_ASSERT(clearance_of(result.waypoints, world, 0.05) >= result.clearance_m - 1e-9);
  }));
  EXPECT_GE(solved, 80);
}

TEST(Planner, SaysWhatMakesNoSense) {
  const World world{{{"post", Box{{1, 1, 8}}, still({5, 0, -4})}}};
  const auto reason = [&](const PlanRequest& request) {
    const PlanResult result = plan(world, request);
    EXPECT_EQ(result.status, PlanStatus::kInvalid);
    EXPECT_TRUE(result.waypoints.empty());
    return result.reason;
  };
  const PlanRequest sound = ask({0, 0, -4}, {9, 0, -4}, 0.6);
  ASSERT_EQ(plan(world, sound).status, PlanStatus::kSuccess);

  PlanRequest request = sound;
  request.start.p.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(reason(request), "the start is not a finite pose");
  request = sound;
  request.goal.q.coeffs() *= 2.0;
  EXPECT_EQ(reason(request), "the goal is not a finite pose");
  request = sound;
  request.previous = {still({0, 0, 0}), still({0, std::numeric_limits<double>::infinity(), 0})};
  EXPECT_EQ(reason(request), "the previous path has a pose that is not finite");
  request = sound;
  request.clearance = -0.1;
  EXPECT_EQ(reason(request), "the clearance must be from 0 to 5 m");
  EXPECT_EQ(reason(ask({5, 0.5, -4}, {9, 0, -4}, 0.6)), "the start is in collision with post");
  EXPECT_EQ(reason(ask({0, 0, -4}, {5.4, 0, -4}, 0.6)), "the goal is in collision with post");
  EXPECT_EQ(reason(ask({0, 0, -4}, {6.2, 0, -4}, 0.6)),
            "the goal is 0.46 m from post, nearer than the clearance of 0.60 m");
  request = sound;
  request.goal.p.z() = 0.5;
  EXPECT_EQ(reason(request), "the goal (z = 0.50 m) is above 0.00 m");
  request = sound;
  request.min_z = -3.0;
  EXPECT_EQ(reason(request), "the goal (z = -4.00 m) is below -3.00 m");
}

World room_around(const Vector3d& centre, double door) {
  // A closed box of 6 m with, in its west wall, a slot of width `door` from floor to ceiling.
  World world;
  const auto add = [&](const char* name, const Vector3d& size, const Vector3d& at) {
    world.obstacles.push_back({name, Box{size}, still(centre + at)});
  };
  add("floor", {6.4, 6.4, 0.2}, {0, 0, -3.1});
  add("roof", {6.4, 6.4, 0.2}, {0, 0, 3.1});
  add("east", {0.2, 6.4, 6.4}, {3.1, 0, 0});
  add("north", {6.4, 0.2, 6.4}, {0, 3.1, 0});
  add("south", {6.4, 0.2, 6.4}, {0, -3.1, 0});
  if (door <= 0.0) {
    add("west", {0.2, 6.4, 6.4}, {-3.1, 0, 0});
  } else {
    const double width = 3.2 - 0.5 * door;
    add("west_left", {0.2, width, 6.4}, {-3.1, 0.5 * (door + width), 0});
    add("west_right", {0.2, width, 6.4}, {-3.1, -0.5 * (door + width), 0});
  }
  return world;
}

TEST(Planner, SaysHonestlyThatThereIsNoWay) {
  const Vector3d inside(5, 0, -6);
  const PlanResult shut = plan(room_around(inside, 0.0), ask({-3, 0, -6}, inside, 0.5));
  EXPECT_EQ(shut.status, PlanStatus::kNoPath);
  EXPECT_EQ(shut.reason, "blocked: there is no way to the goal, and west is in the straight one");
  EXPECT_LT(shut.times.total_ms, 20'000.0);

  // 1.2 m of door and 0.48 m of vehicle: 0.36 m is what there is.
  const World with_door = room_around(inside, 1.2);
  const PlanResult tight = plan(with_door, ask({-3, 0, -6}, inside, 0.6));
  EXPECT_EQ(tight.status, PlanStatus::kNoPath);
  EXPECT_NEAR(tight.clearance_m, 0.36, 0.02);
  EXPECT_EQ(tight.reason.substr(0, 22), "too tight for 0.60 m (");
  EXPECT_NE(tight.reason.find("the best found keeps 0.3"), std::string::npos) << tight.reason;
  EXPECT_EQ(plan(with_door, ask({-3, 0, -6}, inside, 0.33)).status, PlanStatus::kSuccess);
}

// Two long walls, `gap` apart, from x = 0 to 8.
World corridor(double gap) {
  World world;
  for (const double side : {-1.0, 1.0}) {
    world.obstacles.push_back({side < 0.0 ? "south" : "north", Box{{8.0, 10.0, 60.0}},
                               still({4.0, side * (5.0 + 0.5 * gap), -6.0})});
  }
  return world;
}

// What was planned in a place that is too narrow leads out of it, not on through it; else whoever
// plans twice a second would be led in step by step.
TEST(Planner, LeadsOutOfANarrowPlaceAndNotThroughIt) {
  const double gap = kBodySize.y() + 2.0 * 0.37;
  PlanRequest request = ask({0.9, 0, -6}, {12, 0, -6}, 0.6);
  request.attitude = AttitudeMode::kFlat;
  EXPECT_EQ(plan(corridor(gap), request).status, PlanStatus::kNoPath);
  request.goal.p.x() = -4.0;
  request.start.q = from_rpy(0, 0, M_PI);
  const PlanResult out = plan(corridor(gap), request);
  EXPECT_EQ(out.status, PlanStatus::kSuccess) << out.reason;
  EXPECT_NEAR(out.clearance_m, 0.37, 0.01);
}

// A little less than asked for is no narrow place: the vehicle need not turn back for it.
TEST(Planner, GoesOnWhereThereIsNearlyEnough) {
  const World nearly = corridor(kBodySize.y() + 2.0 * 0.55);
  PlanRequest request = ask({2, 0, -6}, {12, 0, -6}, 0.6);
  request.attitude = AttitudeMode::kFlat;
  const PlanResult within = plan(nearly, request);
  EXPECT_EQ(within.status, PlanStatus::kSuccess) << within.reason;
  EXPECT_GE(within.clearance_m, 0.5);
  request.start.p.x() = -4.0;  // from open water it goes round
  EXPECT_GE(plan(nearly, request).clearance_m, 0.6 - 1e-6);
}

// A door w wide and h high leaves a level vehicle min((w - 0.48) / 2, (h - 0.22) / 2), and nobody a
// centimetre more.
TEST(Planner, SaysWhatClearanceWouldHaveWorked) {
  constexpr std::array<std::array<double, 2>, 6> kDoors{
      {{0.7, 1.4}, {0.9, 0.6}, {1.1, 1.1}, {1.3, 0.8}, {1.6, 1.4}, {1.5, 0.6}}};
  for (const auto& [width, height] : kDoors) {
    const double best = std::min((width - kBodySize.y()) / 2.0, (height - kBodySize.z()) / 2.0);
    World world;
    const auto add = [&](double y0, double y1, double z0, double z1) {
      world.obstacles.push_back(
          {"wall", Box{{0.4, y1 - y0, z1 - z0}}, still({4.0, (y0 + y1) / 2.0, (z0 + z1) / 2.0})});
    };
    const double side = width / 2.0;
    const double top = height / 2.0;
    add(-30, -side, -12, 1);
    add(side, 30, -12, 1);
    add(-side, side, -12, -6 - top);
    add(-side, side, -6 + top, 1);
    world.obstacles.push_back({"seabed", HalfSpace{Vector3d::UnitZ()}, still({0, 0, -12})});
    PlanRequest request = ask({0, 1, -6.5}, {8, -1, -5.5}, best + 0.2);
    request.min_z = -12.0;
    // Not around the ends of the wall: the way there is longer than the vehicle may look.
    for (const double y : {-30.0, 30.0}) {
      world.obstacles.push_back({"end", Box{{60, 0.4, 14}}, still({4, y, -6})});
    }
    for (const double x : {-26.0, 34.0}) {
      world.obstacles.push_back({"end", Box{{0.4, 60, 14}}, still({x, 0, -6})});
    }
    const PlanResult result = plan(world, request);
    EXPECT_EQ(result.status, PlanStatus::kNoPath);
    EXPECT_LE(result.clearance_m, best + 1e-9);
    EXPECT_GE(result.clearance_m, std::min(0.95 * best, best - 0.01));
    EXPECT_TRUE(result.reason.starts_with("too tight for") ||
                result.reason.starts_with("no path found that keeps"))
        << result.reason;
    request.clearance = 0.8 * result.clearance_m;
    EXPECT_EQ(plan(world, request).status, PlanStatus::kSuccess);
  }
}

TEST(Planner, KeepsFlatWhenAskedAndPitchesStill) {
  PlanRequest request = ask({0, 0, -2}, {8, 0, -8}, 0.3);
  request.attitude = AttitudeMode::kFlat;
  request.min_z = -20.0;
  const World world{{{"left", Box{{1.0, 9.0, 40.0}}, still({4.5, 4.95, -9})},
                     {"right", Box{{1.0, 9.0, 40.0}}, still({4.5, -4.95, -9})},
                     {"north", Box{{40.0, 1.0, 40.0}}, still({4.5, 9.9, -9})},
                     {"south", Box{{40.0, 1.0, 40.0}}, still({4.5, -9.9, -9})},
                     {"west", Box{{1.0, 20.0, 40.0}}, still({-16, 0, -9})},
                     {"east", Box{{1.0, 20.0, 40.0}}, still({25, 0, -9})}}};
  const PlanResult flat = plan(world, request);
  EXPECT_EQ(flat.status, PlanStatus::kNoPath) << "0.21 m on each side, but for lying on one";
  request.clearance = 0.2;
  const PlanResult narrow = plan(world, request);
  ASSERT_EQ(narrow.status, PlanStatus::kSuccess) << narrow.reason;
  double steepest = 0.0;
  for (const Pose& pose : narrow.waypoints) {
    EXPECT_NEAR(to_rpy(pose.q).x(), 0.0, 1e-9);
    steepest = std::max(steepest, to_rpy(pose.q).y());
  }
  EXPECT_GT(steepest, 0.4);
  request.clearance = 0.3;
  request.attitude = AttitudeMode::kFree;
  EXPECT_EQ(plan(world, request).status, PlanStatus::kSuccess);
}

TEST(Planner, KeepsTheAltitudeWhereItCan) {
  World world;
  world.obstacles.push_back({"seabed", HalfSpace{Vector3d::UnitZ()}, still({0, 0, -10})});
  world.obstacles.push_back({"hump", Box{{4, 40, 2}}, still({8, 0, -9})});
  PlanRequest request = ask({0, 0, -7}, {16, 0, -7}, 0.4);
  const auto altitude_over_hump = [&] {
    const PlanResult result = plan(world, request);
    EXPECT_EQ(result.status, PlanStatus::kSuccess) << result.reason;
    double least = 1e300;
    for (const Pose& pose : result.waypoints) {
      if (std::abs(pose.p.x() - 8.0) < 2.0) least = std::min(least, pose.p.z() + 8.0);
    }
    return least;
  };
  EXPECT_LT(altitude_over_hump(), 1.05);
  request.min_altitude = 2.0;
  EXPECT_GE(altitude_over_hump(), 1.95);
}

TEST(Planner, MovesAGoalWithinItsToleranceAndNoFarther) {
  World world;
  world.obstacles.push_back({"post", Box{{0.4, 0.4, 20}}, still({8, 0, -8})});
  PlanRequest request = ask({0, 0, -5}, {8, 0.6, -5}, 0.5);
  EXPECT_EQ(plan(world, request).status, PlanStatus::kInvalid);
  request.goal_tolerance = 0.8;
  const PlanResult moved = plan(world, request);
  ASSERT_EQ(moved.status, PlanStatus::kSuccess) << moved.reason;
  EXPECT_LE((moved.waypoints.back().p - request.goal.p).norm(), 0.8 + 1e-9);
  EXPECT_GE(clearance_of(moved.waypoints, world, 0.01), 0.5);
  request.goal_tolerance = 0.05;
  EXPECT_EQ(plan(world, request).status, PlanStatus::kInvalid);
}

TEST(Planner, AHullThatIsLargerThanTheWorldIsToldSo) {
  const RobotHull giant{{{"body", box_corners({50.0, 40.0, 30.0})}}};
  SteadyClock clock;
  const World world{{{"pebble", Box{{0.1, 0.1, 0.1}}, still({10, 0, -40})}}};
  PlanRequest request = ask({0, 0, -40}, {20, 0, -40}, 0.3);
  request.min_z = -100.0;
  const PlanResult inside = Planner(world, giant, {}, clock).plan(request);
  EXPECT_EQ(inside.status, PlanStatus::kInvalid);
  EXPECT_EQ(inside.reason, "the start is in collision with pebble");
  request.start.p.y() = request.goal.p.y() = 60.0;
  EXPECT_EQ(Planner(world, giant, {}, clock).plan(request).status, PlanStatus::kSuccess);
}

TEST(Planner, LetsAVehicleOutThatIsNearerThanItShouldBe) {
  const World world{{{"wall", Box{{40.0, 1.0, 10.0}}, still({10, -1.5, -5})}}};  // face at y = -1
  const PlanRequest request = ask({0, -0.5, -5}, {8, 3, -5}, 0.6);  // starts 0.26 m from it
  const PlanResult result = plan(world, request);
  ASSERT_EQ(result.status, PlanStatus::kSuccess) << result.reason;
  EXPECT_NEAR(result.clearance_m, 0.26, 0.021) << "told as it is";
  const std::span<const Pose> rest = std::span(result.waypoints).subspan(2);
  EXPECT_GE(clearance_of({rest.begin(), rest.end()}, world, 0.05), 0.6 - 1e-6);
}

TEST(Planner, GoesOnFromAPathItIsGiven) {
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

TEST(Planner, SameRequestSameBits) {
  const World world = window();
  const PlanResult a = plan(world, ask(kGate, kRoomB, 1.0));
  const PlanResult b = plan(world, ask(kGate, kRoomB, 1.0));
  ASSERT_EQ(a.waypoints.size(), b.waypoints.size());
  for (std::size_t i = 0; i < a.waypoints.size(); ++i) {
    EXPECT_EQ(a.waypoints[i].p, b.waypoints[i].p);
    EXPECT_EQ(a.waypoints[i].q.coeffs(), b.waypoints[i].q.coeffs());
  }
  EXPECT_EQ(a.clearance_m, b.clearance_m);
}

TEST(PlannerOptions, NameWhatIsOutOfRange) {
  PlannerOptions options;
  EXPECT_EQ(options.validate(), "");
  options.waypoint_spacing_m = 0.0;
  EXPECT_EQ(options.validate(), "waypoint_spacing_m must be from 0.1 to 10 m");
  options = {};
  options.max_warm_starts = 101;
  EXPECT_EQ(options.validate(), "max_warm_starts must be from 0 to 100");
}

}  // namespace
}  // namespace dive::planning
