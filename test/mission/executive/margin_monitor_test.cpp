// The margin of the position where the vehicle is and where its path leads next.

#include "mission/executive/margin_monitor.h"

#include <cmath>

#include <gtest/gtest.h>

#include "test/planning/boxes.h"

namespace dive::mission {
namespace {

using Eigen::Vector3d;

const Eigen::Matrix2d kP = 0.01 * Eigen::Matrix2d::Identity();

class MarginMonitorTest : public ::testing::Test {
 protected:
  static planning::World world() {
    planning::World world;
    world.obstacles.push_back({"wall", planning::Box{{1, 60, 60}}, Pose{{5.5, 0, 0}}});
    return world;
  }

  planning::Scene scene_{world()};
  MarginMonitor monitor_{{{{"body", dive::testing::box_corners(Vector3d(0.6, 0.4, 0.2))}}}, scene_};
};

// The way turns 0.4 m from the wall, between two of its waypoints nothing is nearer.
TEST_F(MarginMonitorTest, ThePathAheadCountsAsThePresentPlaceDoes) {
  const Pose here{{3.0, 0, -5}};
  monitor_.update(0, scene_, here, {}, kP);
  EXPECT_NEAR(monitor_.least().margin_sigma, (1.7 - 0.1) / 0.1, 1e-3);
  const std::vector<Pose> way = {here, Pose{{4.3, 0, -5}}, Pose{{3.5, 0, -5}}};
  monitor_.update(0, scene_, here, way, kP);
  EXPECT_NEAR(monitor_.least().margin_sigma, (0.4 - 0.1) / 0.1, 1e-3);
  EXPECT_DOUBLE_EQ(monitor_.least().place_W.x(), 4.3);
}

// Where it turns its bow to the wall, halfway between two waypoints that lie along it.
TEST_F(MarginMonitorTest, PosesBetweenWaypointsCount) {
  const Pose begin{{4.6, -1.0, -5}, from_rpy(0, 0, deg_to_rad(90.0))};
  const Pose end{{4.6, 1.0, -5}, from_rpy(0, 0, deg_to_rad(-90.0))};
  const std::vector<Pose> way = {begin, end};
  monitor_.update(0, scene_, begin, way, kP);
  EXPECT_LT(monitor_.least().margin_sigma, 0.2);
  EXPECT_LT(std::abs(monitor_.least().place_W.y()), 0.5);
}

TEST_F(MarginMonitorTest, ItIsDueTwiceASecond) {
  EXPECT_TRUE(monitor_.is_due(0));
  monitor_.update(0, scene_, Pose{}, {}, kP);
  EXPECT_FALSE(monitor_.is_due(480'000));
  EXPECT_TRUE(monitor_.is_due(500'000));
}

}  // namespace
}  // namespace dive::mission
