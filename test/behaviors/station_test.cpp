#include <gtest/gtest.h>

#include "behaviors/hold.h"
#include "behaviors/surface.h"

namespace dive::behaviors {
namespace {

estimation::StateEstimate at_depth(double depth, double yaw = 0.7) {
  estimation::StateEstimate estimate;
  estimate.valid = true;
  estimate.X_WB = Pose{{1, 2, -depth}, from_rpy(0.1, -0.1, yaw)};
  return estimate;
}

BehaviorInput input(Utime now, const estimation::StateEstimate& estimate) {
  BehaviorInput input;
  input.now = now;
  input.estimate = &estimate;
  return input;
}

TEST(Hold, KeepsWhereItEnteredAndEndsOnTime) {
  Hold hold(3.0);
  const auto entered = at_depth(4.0);
  EXPECT_FALSE(hold.step(input(from_seconds(10), entered)).done);
  const auto drifted = at_depth(4.5, 1.5);
  const BehaviorOutput output = hold.step(input(from_seconds(12.9), drifted));
  EXPECT_FALSE(output.done);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_NEAR(output.command.d, 4.0, 1e-12);
  EXPECT_NEAR(to_rpy(output.command.o).z(), 0.7, 1e-9);
  EXPECT_NEAR(to_rpy(output.command.o).x(), 0.0, 1e-9) << "level, whatever the attitude was";
  EXPECT_TRUE(hold.step(input(from_seconds(13.0), drifted)).done);
}

TEST(Surface, RisesSteadilyAndUsesTheDepthSensorOnly) {
  Surface surface;
  const auto deep = at_depth(4.0);
  EXPECT_NEAR(surface.step(input(0, deep)).command.d, 4.0, 1e-12);
  EXPECT_NEAR(surface.step(input(from_seconds(4), deep)).command.d, 3.0, 1e-12);
  const BehaviorOutput late = surface.step(input(from_seconds(100), deep));
  EXPECT_EQ(late.command.d, 0.0);
  EXPECT_FALSE(late.done) << "the clock alone is no proof of air";
  const auto up = at_depth(0.1);
  EXPECT_TRUE(surface.step(input(from_seconds(101), up)).done);
}

TEST(Surface, WithoutADepthSensorItTakesItsTime) {
  Surface surface;
  const auto deep = at_depth(4.0);
  EXPECT_FALSE(surface.step(input(0, deep)).done);
  const auto up = at_depth(0.1);  // by the estimate
  BehaviorInput blind = input(from_seconds(40), up);
  blind.depth_known = false;
  EXPECT_FALSE(surface.step(blind).done);
  blind.now = from_seconds(2 * 4.0 / 0.25 + 11);
  EXPECT_TRUE(surface.step(blind).done);
}

}  // namespace
}  // namespace dive::behaviors
