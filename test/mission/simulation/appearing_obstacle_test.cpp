// The vehicle's update covers the box of the ground truth, no less and no more.

#include "mission/simulation/appearing_obstacle.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "planning/world/observed_map.h"

namespace dive::mission {
namespace {

using Eigen::Vector3d;

// Of boxes of 0.6 m to the schema's largest, in any attitude.
TEST(AppearingObstacle, IsObservedAsTheBoxThatItIs) {
  for (const Vector3d& size : {Vector3d(0.6, 0.6, 0.6), Vector3d(100, 100, 100), {30, 0.05, 13}}) {
    const AppearingObstacle obstacle{{{4, -2, -30}, from_rpy(0.3, -0.4, 1.0)}, size};
    const planning::ObstacleUpdate update = as_update(std::vector{obstacle}, 0, 20'000);
    EXPECT_TRUE(planning::is_well_formed(update)) << size.transpose();
    ASSERT_EQ(update.cells.size(), 1U);
    EXPECT_EQ(update.utime, 20'000);
    double volume = 0.0;
    Eigen::AlignedBox3d whole;
    for (const planning::Polytope& piece : update.cells[0].pieces) {
      EXPECT_EQ(piece.radius, 0.0);
      Eigen::AlignedBox3d part;
      for (const Vector3d& v : piece.vertices) part.extend(obstacle.X_WO.inverse() * v);
      volume += part.volume();
      whole.extend(part);
    }
    EXPECT_TRUE(whole.sizes().isApprox(size, 1e-9)) << size.transpose();
    EXPECT_LT(whole.center().norm(), 1e-9);
    EXPECT_NEAR(volume, size.prod(), 1e-9 * size.prod()) << "the parts do not overlap";
  }
}

TEST(AppearingObstacle, HasACellOfItsOwn) {
  planning::ObservedMap map;
  const AppearingObstacle one{{{0, 0, -3}}, Vector3d::Ones()};
  ASSERT_TRUE(map.apply(as_update(std::vector{one, one}, 0, 1)));
  ASSERT_TRUE(map.apply(as_update(std::vector{one}, 2, 2)));
  EXPECT_EQ(map.pieces(), 3U);
  EXPECT_EQ(as_obstacles(std::vector{one}, 2).at(0).name, "obstacle 3");
}

}  // namespace
}  // namespace dive::mission
