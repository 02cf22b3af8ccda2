// The margin of the position beside walls, from distances and variances worked out by hand.

#include "planning/certify/position_margin.h"

#include <cmath>

#include <gtest/gtest.h>

#include "test/planning/boxes.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::box_corners;

// A wall whose west face is at x = 5, and a floor at z = -10.
World world() {
  World world;
  world.obstacles.push_back({"wall", Box{{1, 60, 60}}, Pose{{5.5, 0, 0}}});
  world.obstacles.push_back({"floor", Box{{60, 60, 1}}, Pose{{0, 0, -10.5}}});
  return world;
}

class PositionMarginTest : public ::testing::Test {
 protected:
  // Of a hull 0.6 m long, 0.4 m wide, 0.2 m high that heads along x.
  PositionMargin at(const Vector3d& p_W, const Eigen::Matrix2d& P_W) {
    PositionMargin least;
    meter_.reduce(scene_, Pose{p_W}, P_W, least);
    return least;
  }

  Scene scene_{world()};
  PositionMarginMeter meter_{{{{"body", box_corners(Vector3d(0.6, 0.4, 0.2))}}}};
};

TEST_F(PositionMarginTest, OnlyTheUncertaintyTowardsTheObstacleCounts) {
  Eigen::Matrix2d P;
  P << 0.04, 0.0, 0.0, 9.0;  // 0.2 m across the wall, 3 m along it
  const PositionMargin least = at({4.0, 0, -5}, P);
  EXPECT_NEAR(least.clearance_m, 0.7, 1e-6);
  EXPECT_NEAR(least.sigma_m, 0.2, 1e-6);
  EXPECT_NEAR(least.margin_sigma, (0.7 - 0.1) / 0.2, 1e-4);
  EXPECT_EQ(least.obstacle, 0);
}

TEST_F(PositionMarginTest, CorrelatedErrorsAreProjectedOnTheNormal) {
  Eigen::Matrix2d turn;
  turn << std::cos(0.5), -std::sin(0.5), std::sin(0.5), std::cos(0.5);
  const Eigen::Matrix2d P = turn * Eigen::Vector2d(0.01, 0.25).asDiagonal() * turn.transpose();
  const double variance = 0.01 * std::pow(std::cos(0.5), 2) + 0.25 * std::pow(std::sin(0.5), 2);
  EXPECT_NEAR(at({4.0, 0, -5}, P).margin_sigma, 0.6 / std::sqrt(variance), 1e-4);
}

TEST_F(PositionMarginTest, HeightIsKnownFromTheDepthSensor) {
  const PositionMargin least = at({0, 0, -9.5}, 100.0 * Eigen::Matrix2d::Identity());
  EXPECT_EQ(least.obstacle, 1);
  EXPECT_NEAR(least.margin_sigma, (0.4 - 0.1) / 0.05, 0.01);
}

TEST_F(PositionMarginTest, WhatIsFarAwayIsNoDangerAndAContactIsNegative) {
  EXPECT_TRUE(std::isinf(at({0, 0, -5}, Eigen::Matrix2d::Identity()).margin_sigma));
  EXPECT_LT(at({4.8, 0, -5}, Eigen::Matrix2d::Identity()).margin_sigma, 0.0);
}

TEST_F(PositionMarginTest, TheLeastOfSeveralPosesIsKept) {
  PositionMargin least;
  const Eigen::Matrix2d P = 0.01 * Eigen::Matrix2d::Identity();
  for (const double x : {3.0, 4.2, 3.5}) meter_.reduce(scene_, Pose{{x, 0, -5}}, P, least);
  EXPECT_NEAR(least.margin_sigma, (0.5 - 0.1) / 0.1, 1e-4);
  EXPECT_DOUBLE_EQ(least.place_W.x(), 4.2);
}

}  // namespace
}  // namespace dive::planning
