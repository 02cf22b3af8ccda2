#include "behaviors/trail.h"

#include <gtest/gtest.h>

#include "behaviors/retrace.h"

namespace dive::behaviors {
namespace {

// East in open water to x = 0, then on under a roof to x = 10.
Trail swum_in(double spacing = 0.5, std::size_t capacity = 4096) {
  Trail trail(spacing, capacity);
  for (double x = -4.0; x <= 10.0; x += 0.01) trail.add({x, 0, -4}, x < 0.0);
  return trail;
}

TEST(Trail, LeadsBackToTheLastOpenWater) {
  const Trail::WayOut way = swum_in().way_out({10.0, 0.3, -4});
  EXPECT_TRUE(way.reaches_open_water);
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
  EXPECT_FALSE(trail.way_out({5, 0, -4}).reaches_open_water);
  EXPECT_FALSE(Trail().way_out({5, 0, -4}).reaches_open_water);
}

TEST(Trail, StaysBoundedAndKeepsTheWayOut) {
  const Trail trail = swum_in(0.05, 64);
  EXPECT_LE(trail.size(), 64U);
  const Trail::WayOut way = trail.way_out({10.0, 0, -4});
  EXPECT_TRUE(way.reaches_open_water);
  EXPECT_NEAR(way.length_m, 10.0, 1.0);
}

BehaviorOutput step(Retrace& retrace, Utime now, const Eigen::Vector3d& p_W) {
  estimation::StateEstimate estimate;
  estimate.valid = true;
  estimate.X_WB.p = p_W;
  return retrace.step({now, &estimate, nullptr});
}

TEST(Retrace, IsDoneAtOnceInOpenWater) {
  Retrace retrace(Trail(), {0, 0, -3}, true, 0.4);
  EXPECT_TRUE(step(retrace, 0, {0, 0, -3}).done);
}

TEST(Retrace, FailsWhenThereIsNoWayOut) {
  Retrace retrace(Trail(), {0, 0, -3}, false, 0.4);
  const BehaviorOutput output = step(retrace, 0, {0, 0, -3});
  EXPECT_TRUE(output.failed);
  EXPECT_FALSE(output.done);
}

TEST(Retrace, SwimsBackAndFailsWhenItDoesNotGetOn) {
  const Trail trail = swum_in();
  Retrace retrace(trail, {10, 0, -4}, false, 0.4);
  Utime now = 0;
  BehaviorOutput output = step(retrace, now, {10, 0, -4});
  EXPECT_FALSE(output.failed);
  EXPECT_LT((output.command.o * Eigen::Vector3d::UnitX()).x(), -0.9) << "the way out is west";
  EXPECT_NEAR(output.command.d, 4.0, 1e-6);
  while (!output.failed && now < from_seconds(1000)) {
    now += from_seconds(1.0);
    output = step(retrace, now, {9.5, 0, -4});  // stuck
  }
  EXPECT_TRUE(output.failed);
  EXPECT_NEAR(to_seconds(now), 60.0 + 4 * 10.3 / 0.4, 10.0);
}

}  // namespace
}  // namespace dive::behaviors
