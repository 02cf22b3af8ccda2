#include "planning/warm_start/warm_start.h"

#include <thread>

#include <gtest/gtest.h>

#include "planning/world/sdf.h"
#include "test/planning/boxes.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::still;

const Vector3d kGate(-1.0, -2.0, -4.0);
const Vector3d kFarRoom(9.8, -2.0, -4.6);

World window() {
  Diagnostics diagnostics;
  auto world = load_sdf(DIVE_SOURCE_DIR "/missions/maps/window.sdf", diagnostics);
  return world.value_or(World{});
}

// A wall across y with two openings, 1.5 m wide, at y = -3 and y = 3; no path over or under it.
World two_doors() {
  World world;
  const auto add = [&](const Vector3d& centre, const Vector3d& size) {
    world.obstacles.push_back({"wall", Box{size}, still(centre)});
  };
  add({0, 0, -5}, {0.3, 4.5, 10});
  add({0, 23.75, -5}, {0.3, 40, 10});
  add({0, -23.75, -5}, {0.3, 40, 10});
  return world;
}

double distance_to(const World& world, const Vector3d& p) {
  double least = 1e300;
  for (const Obstacle& o : world.obstacles) {
    least = std::min(least, testing::point_to_box(p, {std::get<Box>(o.shape).size, o.X_WO}));
  }
  return least;
}

void expect_free(const World& world, const std::vector<Vector3d>& path, double radius,
                 const std::vector<VirtualObstacle>& balls) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    for (int k = 0; k <= 500; ++k) {
      const Vector3d p = path[i - 1] + (path[i] - path[i - 1]) * k / 500.0;
      ASSERT_GT(distance_to(world, p), radius - 0.006) << p.transpose();
      for (const VirtualObstacle& ball : balls) {
        ASSERT_GT((p - ball.centre_W).norm(), ball.radius - 0.006) << p.transpose();
      }
    }
  }
}

// The first point from the start at which the path crosses the plane x = `x`.
Vector3d crossing(const std::vector<Vector3d>& path, double x) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double a = path[i - 1].x() - x;
    const double b = path[i].x() - x;
    if (a * b <= 0.0 && a != b) return path[i - 1] + (path[i] - path[i - 1]) * (a / (a - b));
  }
  return Vector3d::Constant(1e9);
}

TEST(WarmStart, FindsTheWindow) {
  const World world = window();
  WarmStart warm_start(world, {});
  const std::vector<VirtualObstacle> balls{{{5.9, -2.0, -4.4}, 1.0}};
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto path = warm_start.plan(kGate, kFarRoom, balls, 1.5, seed);
    ASSERT_TRUE(path) << seed;
    EXPECT_EQ(path->front(), kGate);
    EXPECT_EQ(path->back(), kFarRoom);
    for (std::size_t i = 1; i < path->size(); ++i) {
      EXPECT_LE(((*path)[i] - (*path)[i - 1]).norm(), 1.5 + 1e-9);
    }
    expect_free(world, *path, 0.3, balls);
    const Vector3d through = crossing(*path, 6.15);
    EXPECT_GT(through.y(), 0.6);
    EXPECT_LT(through.y(), 3.6);
    EXPECT_GT(through.z(), -6.0);
    EXPECT_LT(through.z(), -3.2);
  }
}

TEST(WarmStart, GivesTheSamePathForTheSameSeedOnAnyThread) {
  const World world = window();
  const auto plan = [&](std::uint64_t seed) {
    return WarmStart(world, {}).plan(kGate, kFarRoom, {}, 1.5, seed);
  };
  const auto first = plan(5);
  ASSERT_TRUE(first);
  EXPECT_NE(plan(6), first);
  std::optional<std::vector<Vector3d>> again;
  std::optional<std::vector<Vector3d>> beside;
  std::thread one([&] { again = plan(5); });
  std::thread other([&] { beside = plan(9); });
  one.join();
  other.join();
  EXPECT_EQ(again, first);
  EXPECT_EQ(beside, plan(9));
}

TEST(WarmStart, TakesTheOtherPassageWhenAVirtualObstacleBlocksOne) {
  const World world = two_doors();
  WarmStart warm_start(world, {});
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    for (const double closed : {-3.0, 3.0}) {
      const std::vector<VirtualObstacle> balls{{{0, closed, -1}, 1.0}, {{0, closed, -2.5}, 1.0},
                                               {{0, closed, -4}, 1.0}, {{0, closed, -5.5}, 1.0},
                                               {{0, closed, -7}, 1.0}, {{0, closed, -8.5}, 1.0}};
      const auto path = warm_start.plan({-3, 0, -4}, {3, 0, -4}, balls, 1.5, seed);
      ASSERT_TRUE(path) << seed;
      expect_free(world, *path, 0.3, balls);
      EXPECT_LT(crossing(*path, 0.0).y() * closed, 0.0);
    }
  }
}

TEST(WarmStart, KeepsToTheDepthLimitsExceptAtItsEnds) {
  const World world = two_doors();
  WarmStart warm_start(world, {.limits = {.min_z = -4.5, .max_z = -3.5}});
  const auto path = warm_start.plan({-3, 0, -4}, {3, 0, -4}, {}, 0.5, 1);
  ASSERT_TRUE(path);
  for (const Vector3d& p : *path) {
    EXPECT_GE(p.z(), -4.5);
    EXPECT_LE(p.z(), -3.5);
  }
  EXPECT_TRUE(warm_start.plan({-3, 0, -0.1}, {3, 0, -6}, {}, 0.5, 1));
}

TEST(WarmStart, GivesUpWhereThereIsNoPath) {
  World world = window();
  world.obstacles.push_back({"shutter", Box{{0.3, 3.0, 2.8}}, still({6.15, 2.1, -4.6})});
  WarmStart warm_start(world, {.max_iterations = 2'000});
  EXPECT_FALSE(warm_start.plan({1.0, -2.0, -4.0}, kFarRoom, {}, 1.5, 1));
}

TEST(WarmStart, StartsWhereItIsTightButNotInsideASolid) {
  const World world = two_doors();
  WarmStart warm_start(world, {});
  EXPECT_TRUE(warm_start.plan({-0.25, 0, -4}, {3, 0, -4}, {}, 1.5, 1));  // 0.1 m off the wall.
  EXPECT_FALSE(warm_start.plan({0, 0, -4}, {3, 0, -4}, {}, 1.5, 1));
}

TEST(WarmStart, ShrinksAVirtualObstacleThatHoldsTheStart) {
  const World world = two_doors();
  WarmStart warm_start(world, {});
  const std::vector<VirtualObstacle> balls{{{-2.5, 0, -4}, 2.0}};
  const auto path = warm_start.plan({-3, 0, -4}, {3, 0, -4}, balls, 1.5, 1);
  ASSERT_TRUE(path);
  expect_free(world, *path, 0.3, {{{-2.5, 0, -4}, 0.44}});
}

}  // namespace
}  // namespace dive::planning
