#include "behaviors/trail.h"

#include <gtest/gtest.h>

namespace dive::behaviors {
namespace {

// East in open water to x = 0, then on under a roof to x = 10.
Trail swum_in(double spacing = 0.5, std::size_t capacity = 4096) {
  Trail trail(spacing, capacity);
  for (double x = -4.0; x <= 10.0; x += 0.01) trail.add({x, 0, -4}, x < 0.0);
  return trail;
}

TEST(Trail, LeadsBackToTheLastOpenWater) {
  const Trail::Way way = swum_in().way_out({10.0, 0.3, -4}, 0.0);
  EXPECT_TRUE(way.arrives);
  EXPECT_LT(way.points.back().x(), 0.0);
  EXPECT_GT(way.points.back().x(), -0.55);
  EXPECT_NEAR(way.length_m, 10.3, 0.6);
  for (std::size_t i = 1; i < way.points.size(); ++i) {
    EXPECT_LE((way.points[i] - way.points[i - 1]).norm(), 0.61);
  }
}

TEST(Trail, SaysWhenItNeverSawOpenWater) {
  Trail trail;
  for (double x = 0.0; x < 5.0; x += 0.1) trail.add({x, 0, -4}, false);
  EXPECT_FALSE(trail.way_out({5, 0, -4}, 0.0).arrives);
  EXPECT_FALSE(Trail().way_out({5, 0, -4}, 0.0).arrives);
}

TEST(Trail, StaysBoundedAndKeepsTheWayOut) {
  const Trail trail = swum_in(0.05, 64);
  EXPECT_LE(trail.size(), 64U);
  const Trail::Way way = trail.way_out({10.0, 0, -4}, 0.0);
  EXPECT_TRUE(way.arrives);
  EXPECT_NEAR(way.length_m, 10.0, 1.0);
}

// In along y = 0 to x = 20, and half of the way back along y = 0.3.
TEST(Trail, LeavesOutWhereItHasBeenTwice) {
  Trail trail;
  for (double x = -4.0; x <= 20.0; x += 0.1) trail.add({x, 0, -4}, x < 0.0);
  for (double x = 20.0; x >= 10.0; x -= 0.1) trail.add({x, 0.3, -4}, false);
  const Eigen::Vector3d here(10.0, 0.3, -4);
  const Trail::Way there_and_back = trail.way_out(here, 0.0);
  EXPECT_NEAR(there_and_back.length_m, 30.0, 1.0);
  const Trail::Way straight_out = trail.way_out(here, 0.6);
  EXPECT_TRUE(straight_out.arrives);
  EXPECT_NEAR(straight_out.length_m, 10.3, 0.8);
  EXPECT_EQ(straight_out.points.front(), here);
  EXPECT_LT(straight_out.points.back().x(), 0.0);
  for (std::size_t i = 1; i < straight_out.points.size(); ++i) {
    EXPECT_LE((straight_out.points[i] - straight_out.points[i - 1]).norm(), 0.61);
  }
}

TEST(Trail, KnowsHowFarInItIs) {
  const Trail trail = swum_in();
  EXPECT_NEAR(trail.penetration_m(), 10.0, 0.6);
  Trail out = trail;
  out.add({-1, 0, -4}, true);
  EXPECT_EQ(out.penetration_m(), 0.0);
}

}  // namespace
}  // namespace dive::behaviors
