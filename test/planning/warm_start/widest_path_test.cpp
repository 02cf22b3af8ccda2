// The widest path: its clearance, its bound, and the case without a path.

#include "planning/warm_start/widest_path.h"

#include <gtest/gtest.h>

#include "test/planning/reference.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::still;

// A wall across x with a hole of `height` x `width` at y = 4 and one of 0.8 x 0.8 at y = -4.
World wall(double width, double height) {
  World world;
  const auto add = [&](double y0, double y1, double z0, double z1) {
    if (y1 - y0 <= 0.0 || z1 - z0 <= 0.0) return;
    world.obstacles.push_back(
        {"wall", Box{{0.2, y1 - y0, z1 - z0}}, still({0.0, (y0 + y1) / 2.0, (z0 + z1) / 2.0})});
  };
  add(-10, 10, -5 + height / 2, 0);
  add(-10, 10, -10, -5 - height / 2);
  add(-10, -4.4, -5 - height / 2, -5 + height / 2);
  add(-3.6, 4 - width / 2, -5 - height / 2, -5 + height / 2);
  add(4 + width / 2, 10, -5 - height / 2, -5 + height / 2);
  return world;
}

WidestPathQuery across() {
  WidestPathQuery query;
  query.start_W = {-6, -3, -5};
  query.goal_W = {6, -3, -5};
  query.region = Eigen::AlignedBox3d(Vector3d(-8, -9.5, -9.5), Vector3d(8, 9.5, -0.5));
  return query;
}

TEST(WidestPath, TakesTheWiderHoleThoughItIsFarther) {
  for (const double width : {1.2, 1.6, 1.9}) {
    const World world = wall(width, 3.0);
    const auto path = widest_path(Scene(world), across());
    ASSERT_TRUE(path);
    EXPECT_NEAR(path->radius, width / 2, 0.11) << "half a cell";
    EXPECT_LE(path->radius, width / 2 + 1e-9);
    EXPECT_GE(path->bound, width / 2 - 1e-9);
    EXPECT_LT(path->bound, width / 2 + 0.4);
    double y = 0.0;
    for (const Vector3d& p : path->positions) {
      if (std::abs(p.x()) < 0.11) y = p.y();
    }
    EXPECT_NEAR(y, 4.0, 0.2);
    EXPECT_EQ(path->positions.front(), across().start_W);
    EXPECT_EQ(path->positions.back(), across().goal_W);
  }
}

TEST(WidestPath, MoreClearanceThanEnoughIsWorthNoDetour) {
  WidestPathQuery query = across();
  query.enough = 0.3;
  const auto path = widest_path(Scene(wall(1.9, 3.0)), query);
  ASSERT_TRUE(path);
  EXPECT_EQ(path->radius, 0.3);
  for (const Vector3d& p : path->positions) EXPECT_LT(p.y(), 0.0);
}

TEST(WidestPath, ThereIsNoneThroughAWallWithoutAHole) {
  World world = wall(1.2, 3.0);
  world.obstacles.push_back({"shutter", Box{{0.2, 20, 4}}, still({0.0, 0.0, -5.0})});
  EXPECT_FALSE(widest_path(Scene(world), across()));
}

}  // namespace
}  // namespace dive::planning
