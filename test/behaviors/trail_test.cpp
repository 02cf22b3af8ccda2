#include "behaviors/trail.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace dive::behaviors {
namespace {

// East in open water to x = 0, then under an overhead to x = 10.
Trail swum_in(double spacing = 0.5, std::size_t capacity = 4096) {
  Trail trail(spacing, capacity);
  for (double x = -4.0; x <= 10.0; x += 0.01) trail.add({x, 0, -4}, x < 0.0);
  return trail;
}

TEST(Trail, LeadsBackToTheLastOpenWater) {
  const Trail::Path path = swum_in().exit_path({10.0, 0.3, -4}, 0.0);
  EXPECT_TRUE(path.arrives);
  EXPECT_LT(path.points.back().x(), 0.0);
  EXPECT_GT(path.points.back().x(), -0.55);
  EXPECT_NEAR(path.length_m, 10.3, 0.6);
  for (std::size_t i = 1; i < path.points.size(); ++i) {
    EXPECT_LE((path.points[i] - path.points[i - 1]).norm(), 0.61);
  }
}

TEST(Trail, ReportsThatItHasNoOpenWater) {
  Trail trail;
  for (double x = 0.0; x < 5.0; x += 0.1) trail.add({x, 0, -4}, false);
  EXPECT_FALSE(trail.exit_path({5, 0, -4}, 0.0).arrives);
  EXPECT_FALSE(Trail().exit_path({5, 0, -4}, 0.0).arrives);
}

TEST(Trail, StaysBoundedAndKeepsTheExitPath) {
  const Trail trail = swum_in(0.05, 64);
  EXPECT_LE(trail.size(), 64U);
  const Trail::Path path = trail.exit_path({10.0, 0, -4}, 0.0);
  EXPECT_TRUE(path.arrives);
  EXPECT_NEAR(path.length_m, 10.0, 1.0);
}

// In along y = 0 to x = 20, and half of the way back along y = 0.3.
TEST(Trail, LeavesOutWhereItHasBeenTwice) {
  Trail trail;
  for (double x = -4.0; x <= 20.0; x += 0.1) trail.add({x, 0, -4}, x < 0.0);
  for (double x = 20.0; x >= 10.0; x -= 0.1) trail.add({x, 0.3, -4}, false);
  const Eigen::Vector3d here(10.0, 0.3, -4);
  const Trail::Path there_and_back = trail.exit_path(here, 0.0);
  EXPECT_NEAR(there_and_back.length_m, 30.0, 1.0);
  const Trail::Path straight_out = trail.exit_path(here, 0.6);
  EXPECT_TRUE(straight_out.arrives);
  EXPECT_NEAR(straight_out.length_m, 10.3, 0.8);
  EXPECT_EQ(straight_out.points.front(), here);
  EXPECT_LT(straight_out.points.back().x(), 0.0);
  for (std::size_t i = 1; i < straight_out.points.size(); ++i) {
    EXPECT_LE((straight_out.points[i] - straight_out.points[i - 1]).norm(), 0.61);
  }
}

TEST(Trail, MeasuresThePenetration) {
  const Trail trail = swum_in();
  EXPECT_NEAR(trail.penetration_m(), 10.0, 0.6);
  Trail out = trail;
  out.add({-1, 0, -4}, true);
  EXPECT_EQ(out.penetration_m(), 0.0);
}

// The first breadcrumb from before a restart, and the last half of the others in a place that
// drifts.
TEST(Trail, MovesWithALoopClosureByTheTimeOfEachBreadcrumb) {
  Trail trail;
  trail.restore(std::vector<Trail::Breadcrumb>{{{-1, 0, -4}, true}}, kTrailSpacing);
  for (int x = 0; x <= 10; ++x) trail.add({1.0 * x, 0, -4}, false, from_seconds(10.0 + x));
  trail.move({{{from_seconds(15.0), {}}, {from_seconds(20.0), {0.0, {0.0, 2.0}}}}});
  EXPECT_EQ(trail.moves(), 1U);
  const std::vector<Trail::Breadcrumb>& breadcrumbs = trail.breadcrumbs();
  ASSERT_EQ(breadcrumbs.size(), 12U);
  EXPECT_EQ(breadcrumbs[0].p_W, Eigen::Vector3d(-1, 0, -4));
  EXPECT_EQ(breadcrumbs[5].p_W, Eigen::Vector3d(4, 0, -4));
  EXPECT_NEAR(breadcrumbs[8].p_W.y(), 0.8, 1e-12);
  EXPECT_NEAR(breadcrumbs[11].p_W.y(), 2.0, 1e-12);
  EXPECT_NEAR(trail.penetration_m(), 6.0 + 5.0 * std::hypot(1.0, 0.4), 1e-9);
}

TEST(Trail, LeadsToAGoalNearIt) {
  const Trail trail = swum_in();
  const std::vector<Pose> back = trail_to(trail, {10.0, 0.2, -4}, {-2.0, 0.5, -4.5}, 0.0);
  ASSERT_GE(back.size(), 20U);
  EXPECT_EQ(back.front().p, Eigen::Vector3d(10.0, 0.2, -4));
  EXPECT_EQ(back.back().p, Eigen::Vector3d(-2.0, 0.5, -4.5));
  EXPECT_NEAR(std::abs(to_rpy(back[5].q).z()), M_PI, 1e-6) << "level, and bow first";
  EXPECT_NEAR(to_rpy(back.back().q).y(), 0.0, 1e-9);

  EXPECT_TRUE(trail_to(trail, {10.0, 0.2, -4}, {-2.0, 1.5, -4}, 0.0).empty());
  EXPECT_TRUE(trail_to(Trail(), {10.0, 0.2, -4}, {-2.0, 0, -4}, 0.0).empty());
}

// Round three sides of a square of 20 m: the way back is 60 m, and the goal 20 m away.
TEST(Trail, DoesNotLeadALongWayRound) {
  Trail trail;
  for (double s = 0.0; s < 20.0; s += 0.5) trail.add({s, 0, -4}, true);
  for (double s = 0.0; s < 20.0; s += 0.5) trail.add({20, s, -4}, true);
  for (double s = 20.0; s > 0.0; s -= 0.5) trail.add({s, 20, -4}, true);
  EXPECT_EQ(trail_to(trail, {0, 20, -4}, {0, 0, -4}, 0.4).size(), 121U);
  EXPECT_TRUE(trail_to(trail, {0, 20, -4}, {0, 10, -4}, 0.4).empty()) << "not near it";
  for (double s = 20.0; s > 10.0; s -= 0.5) trail.add({0, s, -4}, true);
  EXPECT_TRUE(trail_to(trail, {0, 10, -4}, {0, 0, -4}, 0.4).empty()) << "70 m";
}

}  // namespace
}  // namespace dive::behaviors
