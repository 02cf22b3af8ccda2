// The planner on the Window environment and on scenes with known results.

#include "planning/planner.h"

#include <array>
#include <limits>
#include <memory>
#include <numeric>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/random.h"
#include "planning/map_matching/expected_view.h"
#include "planning/warm_start/warm_start.h"
#include "test/common/arbitrary.h"
#include "test/common/sanitizers.h"
#include "test/planning/planner/planner_sample.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::box_corners;
using testing::still;

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

// Random boxes: every success has the reported clearance, also of a path that was preferred for its
// information, and most requests succeed.
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
    PlannerOptions options;
    if (testing::draw(rc::gen::arbitrary<bool>())) {
      options.preferred_view = std::make_shared<ExpectedView>(world);
    }
    const PlanResult result = plan(world, ask(from, {16, 0, -8}, 0.4), kVehicle, options);
    if (!has_path(result.status)) return;
    ++solved;
    const bool is_reduced = result.status == PlanStatus::kReduced;
    RC_ASSERT(is_reduced == (result.clearance_m < 0.4 - 1e-6));
    RC_ASSERT(is_reduced == result.reduced.has_value());
    RC_ASSERT(result.accepted != is_reduced);
    if (is_reduced) RC_ASSERT(clearance_of({still(from), still(from)}, world, 1.0) < 0.41);
    RC_ASSERT(clearance_of(result.waypoints, world, 0.05) >= result.clearance_m - 1e-9);
  }));
  EXPECT_GE(solved, 80);
}

TEST(Planner, ReportsAnInvalidRequest) {
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
  request.trail = {still({0, 0, 0}), still({0, std::numeric_limits<double>::quiet_NaN(), 0})};
  EXPECT_EQ(reason(request), "the trail has a pose that is not finite");
  request = sound;
  request.limits.clearance = -0.1;
  EXPECT_EQ(reason(request), "the clearance must be from 0 to 5 m");
  for (const double wrong : {-0.1, std::numeric_limits<double>::quiet_NaN()}) {
    request = sound;
    request.limits.reduced_clearance = wrong;
    EXPECT_EQ(reason(request), "the reduced clearance must not be negative");
  }
  EXPECT_EQ(reason(ask({5, 0.5, -4}, {9, 0, -4}, 0.6)), "the start is in collision with post");
  EXPECT_EQ(reason(ask({0, 0, -4}, {5.4, 0, -4}, 0.6)), "the goal is in collision with post");
  EXPECT_EQ(reason(ask({0, 0, -4}, {6.2, 0, -4}, 0.6)),
            "the goal is 0.46 m from post, nearer than the clearance of 0.60 m");
  request = sound;
  request.goal.p.z() = 0.5;
  EXPECT_EQ(reason(request), "the goal (z = 0.50 m) is above 0.00 m");
  request = sound;
  request.limits.min_z = -3.0;
  EXPECT_EQ(reason(request), "the goal (z = -4.00 m) is below -3.00 m");
}

World room_around(const Vector3d& centre, double door) {
  // A closed box of 6 m with a slot of width `door` in its west wall, from floor to ceiling.
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

TEST(Planner, ReportsThatThereIsNoPath) {
  const Vector3d inside(5, 0, -6);
  const PlanResult shut = plan(room_around(inside, 0.0), ask({-3, 0, -6}, inside, 0.5));
  EXPECT_EQ(shut.status, PlanStatus::kNoPath);
  EXPECT_EQ(shut.reason, "blocked: no path leads to the goal; west obstructs the straight one");

  // With 1.2 m of door and 0.48 m of vehicle, 0.36 m is the largest clearance.
  const World with_door = room_around(inside, 1.2);
  const PlanResult tight = plan(with_door, ask({-3, 0, -6}, inside, 0.6));
  EXPECT_EQ(tight.status, PlanStatus::kNoPath);
  EXPECT_NEAR(tight.clearance_m, 0.36, 0.02);
  EXPECT_EQ(tight.reason.substr(0, 22), "too narrow for a clear");
  EXPECT_NE(tight.reason.find("the best path found keeps 0.3"), std::string::npos) << tight.reason;
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

// A plan made in a place that is too narrow leads out of it, not on through it; otherwise planning
// twice a second would lead the vehicle in step by step.
TEST(Planner, LeadsOutOfANarrowPlaceAndNotThroughIt) {
  const double gap = kBodySize.y() + 2.0 * 0.37;
  PlanRequest request = ask({0.9, 0, -6}, {12, 0, -6}, 0.6);
  request.limits.attitude = AttitudeMode::kFlat;
  EXPECT_EQ(plan(corridor(gap), request).status, PlanStatus::kNoPath);
  request.goal.p.x() = -4.0;
  request.start.q = from_rpy(0, 0, M_PI);
  const PlanResult out = plan(corridor(gap), request);
  ASSERT_EQ(out.status, PlanStatus::kReduced) << out.reason;
  EXPECT_NEAR(out.clearance_m, 0.37, 0.01);
  EXPECT_GT(out.reduced->length_m, 0.9) << "to the mouth";
  EXPECT_LT(out.reduced->length_m, kMaxReducedLength);
}

// Slightly less clearance than requested is not a narrow place: the vehicle need not turn back.
TEST(Planner, ContinuesWhereThereIsNearlyEnough) {
  const World nearly = corridor(kBodySize.y() + 2.0 * 0.55);
  PlanRequest request = ask({2, 0, -6}, {12, 0, -6}, 0.6);
  request.limits.attitude = AttitudeMode::kFlat;
  const PlanResult within = plan(nearly, request);
  ASSERT_EQ(within.status, PlanStatus::kReduced) << within.reason;
  EXPECT_GE(within.clearance_m, 0.5);
  EXPECT_GT(within.reduced->length_m, 6.0) << "to the other end";
  request.start.p.x() = -4.0;  // from open water the path goes round
  EXPECT_EQ(plan(nearly, request).status, PlanStatus::kSuccess);
}

// A wall of 0.4 m across x = 4, with a door of `width` and `height` whose middle is at (4, 0, -6).
// There is no path around the wall.
World wall_with_door(double width, double height) {
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
  for (const double y : {-30.0, 30.0}) {
    world.obstacles.push_back({"end", Box{{60, 0.4, 14}}, still({4, y, -6})});
  }
  for (const double x : {-26.0, 34.0}) {
    world.obstacles.push_back({"end", Box{{0.4, 60, 14}}, still({x, 0, -6})});
  }
  return world;
}

// A door w wide and h high leaves a level vehicle a clearance of at most min((w - 0.48) / 2, (h -
// 0.22) / 2).
TEST(Planner, ReportsTheClearanceThatWouldHaveWorked) {
  DIVE_SKIP_UNDER_SANITIZERS("hundreds of plans, and the other tests take the same steps");
  constexpr std::array<std::array<double, 2>, 10> kDoors{{{0.6, 1.4},
                                                          {0.65, 1.0},
                                                          {0.7, 1.4},
                                                          {0.8, 1.2},
                                                          {0.9, 0.6},
                                                          {1.0, 1.4},
                                                          {1.1, 1.1},
                                                          {1.3, 0.8},
                                                          {1.6, 1.4},
                                                          {1.5, 0.6}}};
  for (const auto& [width, height] : kDoors) {
    const double best = std::min((width - kBodySize.y()) / 2.0, (height - kBodySize.z()) / 2.0);
    const World world = wall_with_door(width, height);
    // Starts at several distances beside the door, on either side of it.
    for (const double aside : width < 1.0 ? std::array{-2.0, 3.0} : std::array{1.0, 3.0}) {
      PlanRequest request = ask({0, aside, -6.5}, {8, -1, -5.5}, best + 0.2);
      request.limits.min_z = -12.0;
      const PlanResult result = plan(world, request);
      EXPECT_EQ(result.status, PlanStatus::kNoPath);
      EXPECT_LE(result.clearance_m, best + 1e-9);
      EXPECT_GE(result.clearance_m, 0.95 * best)
          << width << " x " << height << " from " << aside << ", of " << best;
      EXPECT_TRUE(result.reason.starts_with("too narrow for") ||
                  result.reason.starts_with("no path found with a clearance"))
          << result.reason;
      request.limits.clearance = 0.8 * result.clearance_m;
      EXPECT_EQ(plan(world, request).status, PlanStatus::kSuccess)
          << width << " x " << height << " from " << aside << " at " << request.limits.clearance;
    }
  }
}

// A pool divided by a wall of 1 m with two passages. The straight line leads through one of 2.04 x
// 2 m at y = 0; another, of 3 x 1.7 m, is at y = 9.
World two_passages() {
  World world;
  const auto add = [&](double x0, double x1, double y0, double y1, double z0, double z1) {
    world.obstacles.push_back({"wall", Box{{x1 - x0, y1 - y0, z1 - z0}},
                               still({(x0 + x1) / 2.0, (y0 + y1) / 2.0, (z0 + z1) / 2.0})});
  };
  add(-0.5, 0.5, -12, 12, -12, -6);
  add(-0.5, 0.5, -12, 12, -4, 1);
  add(-0.5, 0.5, -12, -1.02, -6, -4);
  add(-0.5, 0.5, 1.02, 7.5, -6, -4);
  add(-0.5, 0.5, 7.5, 10.5, -6, -5.85);
  add(-0.5, 0.5, 7.5, 10.5, -4.15, -4);
  add(-0.5, 0.5, 10.5, 12, -6, -4);
  for (const double side : {-12.0, 12.0}) {
    add(side - 0.2, side + 0.2, -12, 12, -12, 1);
    add(-12, 12, side - 0.2, side + 0.2, -12, 1);
  }
  add(-12, 12, -12, 12, -12, -10);
  return world;
}

// The point at which a path crosses x = 0.
Vector3d crossing(const std::vector<Vector3d>& path) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double from = path[i - 1].x();
    const double to = path[i].x();
    if (from < 0.0 && to >= 0.0)
      return path[i - 1] + (path[i] - path[i - 1]) * (from / (from - to));
  }
  return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

// For a vehicle as flat and wide as this one the nearer passage is 0.06 m too narrow. But a ball
// has a larger clearance in it than in the other, so neither the sampling planner nor the widest
// path leads elsewhere while it is open to them. The virtual obstacle where the optimiser was stuck
// closes it.
TEST(Planner, UsesAnotherPassageWhereTheNearerOneIsTooTight) {
  const Vector3d body_size(0.8, 0.9, 0.2);
  const World world = two_passages();
  PlanRequest request = ask({-6, 0, -5}, {6, 0, -5}, 0.6);

  WarmStartOptions ball;
  ball.check_radius = request.limits.clearance + body_size.z() / 2.0;
  ball.preferred_clearance = ball.check_radius + 0.25;
  WarmStart warm_start(world, ball);
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const auto path = warm_start.plan(request.start.p, request.goal.p, {}, 1.5, seed);
    if (!path) continue;
    EXPECT_LT(std::abs(crossing(*path).y()), 1.02) << seed;
    ++found;
  }
  EXPECT_GE(found, 6);
  const auto widest =
      warm_start.widest(request.start.p, request.goal.p, ball.preferred_clearance, 1.5);
  ASSERT_TRUE(widest);
  EXPECT_LT(std::abs(crossing(widest->positions).y()), 1.02);

  const RobotHull hull{{{"body", box_corners(body_size)}}};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    request.seed = seed;
    const PlanResult result = plan(world, request, hull);
    ASSERT_EQ(result.status, PlanStatus::kSuccess) << seed << ": " << result.reason;
    std::vector<Vector3d> path;
    for (const Pose& pose : result.waypoints) path.push_back(pose.p);
    EXPECT_NEAR(crossing(path).y(), 9.0, 1.5) << seed;
    EXPECT_GE(clearance_of(result.waypoints, world, 0.05, body_size), 0.6 - 1e-9) << seed;
  }
}

// A lane of 1,000 m costs the optimiser no more per waypoint than lanes of 21 m.
TEST(Planner, WorkGrowsWithTheLengthOfThePathAndNoFaster) {
  const auto posts_along = [](double length) {
    World world;
    Random random(7);
    for (double x = 4.0; x < length; x += 8.0) {
      const double y = random.uniform(-1.2, 1.2);
      world.obstacles.push_back({"post", Box{{0.4, 0.4, 20.0}}, still({x, y, -10})});
    }
    return world;
  };
  const auto solved_for_each_waypoint = [&](double length) {
    PlanRequest request = ask({0, 0, -10}, {length, 0, -10}, 0.3);
    const World world = posts_along(length);
    SteadyClock clock;
    Planner planner(world, kVehicle, {}, clock);
    const PlanResult result = planner.plan(request);
    EXPECT_EQ(result.status, PlanStatus::kSuccess) << length << ": " << result.reason;
    return static_cast<double>(planner.statistics().waypoints_solved) /
           static_cast<double>(result.waypoints.size());
  };
  double among_short = 0.0;
  for (const double length : {21.0, 29.0, 37.0, 45.0}) {
    among_short = std::max(among_short, solved_for_each_waypoint(length));
  }
  EXPECT_LE(solved_for_each_waypoint(300.0), 1.3 * among_short);
  EXPECT_LE(solved_for_each_waypoint(1000.0), 1.3 * among_short);
}

// If walls block the straight line, an alternative is searched at each of them, not from end to
// end.
TEST(Planner, FindsAPathAroundEachWallOfALongPath) {
  const auto walls_along = [](double length) {
    World world;
    for (double x = 15.0; x < length; x += 30.0) {
      const double y = static_cast<int>(x / 30.0) % 2 == 0 ? 2.0 : -2.0;
      world.obstacles.push_back({"wall", Box{{0.3, 12.0, 40.0}}, still({x, y, -10})});
    }
    return world;
  };
  const auto solved_for_each_waypoint = [&](double length) {
    const PlanRequest request = ask({0, 0, -10}, {length, 0, -10}, 0.3);
    const World world = walls_along(length);
    SteadyClock clock;
    Planner planner(world, kVehicle, {}, clock);
    const PlanResult result = planner.plan(request);
    EXPECT_EQ(result.status, PlanStatus::kSuccess) << length << ": " << result.reason;
    EXPECT_GE(result.warm_starts, static_cast<int>(world.obstacles.size()));
    return static_cast<double>(planner.statistics().waypoints_solved) /
           static_cast<double>(result.waypoints.size());
  };
  EXPECT_LE(solved_for_each_waypoint(600.0), 1.3 * solved_for_each_waypoint(30.0));
}

TEST(Planner, KeepsFlatWhenAskedAndPitchesStill) {
  PlanRequest request = ask({0, 0, -2}, {8, 0, -8}, 0.3);
  request.limits.attitude = AttitudeMode::kFlat;
  request.limits.min_z = -20.0;
  const World world{{{"left", Box{{1.0, 9.0, 40.0}}, still({4.5, 4.95, -9})},
                     {"right", Box{{1.0, 9.0, 40.0}}, still({4.5, -4.95, -9})},
                     {"north", Box{{40.0, 1.0, 40.0}}, still({4.5, 9.9, -9})},
                     {"south", Box{{40.0, 1.0, 40.0}}, still({4.5, -9.9, -9})},
                     {"west", Box{{1.0, 20.0, 40.0}}, still({-16, 0, -9})},
                     {"east", Box{{1.0, 20.0, 40.0}}, still({25, 0, -9})}}};
  const PlanResult flat = plan(world, request);
  EXPECT_EQ(flat.status, PlanStatus::kNoPath) << "0.21 m on each side, except if it lies on one";
  request.limits.clearance = 0.2;
  const PlanResult narrow = plan(world, request);
  ASSERT_EQ(narrow.status, PlanStatus::kSuccess) << narrow.reason;
  double steepest = 0.0;
  for (const Pose& pose : narrow.waypoints) {
    EXPECT_NEAR(to_rpy(pose.q).x(), 0.0, 1e-9);
    steepest = std::max(steepest, to_rpy(pose.q).y());
  }
  EXPECT_GT(steepest, 0.4);
  request.limits.clearance = 0.3;
  request.limits.attitude = AttitudeMode::kFree;
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
  request.limits.min_altitude = 2.0;
  EXPECT_GE(altitude_over_hump(), 1.95);
}

TEST(Planner, MovesAGoalWithinItsToleranceAndNoFarther) {
  World world;
  world.obstacles.push_back({"post", Box{{0.4, 0.4, 20}}, still({8, 0, -8})});
  PlanRequest request = ask({0, 0, -5}, {8, 0.6, -5}, 0.5);
  EXPECT_EQ(plan(world, request).status, PlanStatus::kInvalid);
  request.limits.goal_tolerance = 0.8;
  const PlanResult moved = plan(world, request);
  ASSERT_EQ(moved.status, PlanStatus::kSuccess) << moved.reason;
  EXPECT_LE((moved.waypoints.back().p - request.goal.p).norm(), 0.8 + 1e-9);
  EXPECT_GE(clearance_of(moved.waypoints, world, 0.01), 0.5);
  request.limits.goal_tolerance = 0.05;
  EXPECT_EQ(plan(world, request).status, PlanStatus::kInvalid);
}

TEST(Planner, AHullThatIsLargerThanTheWorldIsReported) {
  const RobotHull giant{{{"body", box_corners({50.0, 40.0, 30.0})}}};
  SteadyClock clock;
  const World world{{{"pebble", Box{{0.1, 0.1, 0.1}}, still({10, 0, -40})}}};
  PlanRequest request = ask({0, 0, -40}, {20, 0, -40}, 0.3);
  request.limits.min_z = -100.0;
  const PlanResult inside = Planner(world, giant, {}, clock).plan(request);
  EXPECT_EQ(inside.status, PlanStatus::kInvalid);
  EXPECT_EQ(inside.reason, "the start is in collision with pebble");
  request.start.p.y() = request.goal.p.y() = 60.0;
  EXPECT_EQ(Planner(world, giant, {}, clock).plan(request).status, PlanStatus::kSuccess);
}

// The part of a path between two distances from its start.
std::vector<Pose> piece(const std::vector<Pose>& path, double begin, double end) {
  std::vector<Pose> cut;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double length = (path[i].p - path[i - 1].p).norm();
    const auto at = [&](double d) { return interpolate(path[i - 1], path[i], d / length); };
    if (cut.empty() && begin <= length) cut.push_back(at(std::max(begin, 0.0)));
    if (end <= length) {
      cut.push_back(at(end));
      return cut;
    }
    if (!cut.empty()) cut.push_back(path[i]);
    begin -= length;
    end -= length;
  }
  return cut;
}

TEST(Planner, PlansOutOfAStartThatIsTooNearAndReportsIt) {
  const World world{{{"wall", Box{{40.0, 1.0, 10.0}}, still({10, -1.5, -5})}}};  // face at y = -1
  PlanRequest request = ask({0, -0.5, -5}, {8, 3, -5}, 0.6);  // starts 0.26 m from the wall
  const PlanResult result = plan(world, request);
  ASSERT_EQ(result.status, PlanStatus::kReduced) << result.reason;
  EXPECT_FALSE(result.accepted) << "the request does not accept this";
  EXPECT_NEAR(result.clearance_m, 0.26, 0.021);
  ASSERT_TRUE(result.reduced);
  EXPECT_EQ(result.reduced->obstacle, "wall");
  EXPECT_LT((result.reduced->place_W - request.start.p).norm(), 0.3) << "nearest where it starts";
  EXPECT_NE(result.reason.find("the start has a clearance of 0.26"), std::string::npos)
      << result.reason;
  // The path is nearer than 0.6 m up to `length_m`, and not beyond.
  const double narrow = result.reduced->length_m;
  EXPECT_LT(clearance_of(piece(result.waypoints, narrow - 0.1, narrow - 0.03), world, 0.01), 0.6);
  EXPECT_GE(clearance_of(piece(result.waypoints, narrow, 1e9), world, 0.02), 0.6 - 1e-6);

  request.limits.reduced_clearance = 0.2;
  EXPECT_TRUE(plan(world, request).accepted);
  request.limits.reduced_clearance = 0.3;
  const PlanResult refused = plan(world, request);
  EXPECT_EQ(refused.status, PlanStatus::kReduced);
  EXPECT_FALSE(refused.accepted);
}

// Beside a post, at a distance below the tolerance of the certificate.
TEST(Planner, NeverLeavesANearlyTouchingStartByAPathThatMayTouch) {
  const World world{{{"post", Box{{0.4, 0.4, 10.0}}, still({0, 0, -5})}}};
  for (const double gap : {0.0003, 0.001}) {
    for (const Vector3d& goal : {Vector3d(4, 2, -5), Vector3d(0, 6, -2), Vector3d(-3, 4, -8)}) {
      PlanRequest request = ask({0, 0.2 + kBodySize.y() / 2.0 + gap, -5}, goal, 0.6);
      request.limits.attitude = AttitudeMode::kFree;
      request.limits.reduced_clearance = 0.0;
      const PlanResult result = plan(world, request);
      EXPECT_EQ(result.accepted, has_path(result.status));
      EXPECT_TRUE(!has_path(result.status) || result.clearance_m > 0.0)
          << goal.transpose() << ": " << result.clearance_m;
    }
  }
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
  options = {};
  options.information_weight = -1.0;
  EXPECT_EQ(options.validate(), "information_weight must be from 0 to 100");
}

}  // namespace
}  // namespace dive::planning
