#include <algorithm>
#include <cmath>

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

// Rises as it is commanded, in a current to the north-east.
class DriftingAscent {
 public:
  DriftingAscent(double sigma_m, double speed) : estimate_(at_depth(12.0)) {
    estimate_.covariance.diagonal().head<2>().setConstant(sigma_m * sigma_m);
    swims_ = {speed, 0.0};
  }

  // Farthest from the place where the ascent began, m.
  double farthest() {
    Surface surface;
    const Eigen::Vector2d start_W = p_W();
    double farthest = 0.0;
    for (BehaviorOutput output; !output.done && now_ < from_seconds(100);) {
      estimate_.v_WB_B = estimate_.X_WB.q.conjugate() *
                         Eigen::Vector3d(current_W_.x() + swims_.x(), current_W_.y(), 0.0);
      output = surface.step(input(now_, estimate_));
      estimate_.X_WB.q = output.command.o;
      swims_ +=
          0.02 * ((output.command.o * Eigen::Vector3d(output.command.v, 0, 0)).head<2>() - swims_);
      p_W() += 0.02 * (current_W_ + swims_);
      estimate_.X_WB.p.z() = -output.command.d;
      now_ += from_seconds(0.02);
      farthest = std::max(farthest, (p_W() - start_W).norm());
    }
    EXPECT_NEAR(to_seconds(now_), 47.0, 1.0) << "at the same rate";
    return farthest;
  }

 private:
  Eigen::Ref<Eigen::Vector2d> p_W() { return estimate_.X_WB.p.head<2>(); }

  estimation::StateEstimate estimate_;
  Eigen::Vector2d current_W_{0.03, 0.04};
  Eigen::Vector2d swims_;
  Utime now_ = 0;
};

TEST(Surface, KeepsItsPlaceWhileThePositionIsKnown) {
  EXPECT_LT(DriftingAscent(0.1, 0.0).farthest(), 0.3);
  EXPECT_NEAR(DriftingAscent(0.4, 0.0).farthest(), 0.05 * 47.0, 0.1) << "by an uncertain position";
}

TEST(Surface, ItsPlaceIsWhereItHasComeToRest) {
  EXPECT_NEAR(DriftingAscent(0.1, 0.3).farthest(), 0.45, 0.15);
}

TEST(Surface, DoesNotSwimWithoutAttitude) {
  Surface surface;
  auto estimate = at_depth(4.0);
  EXPECT_EQ(surface.step(input(0, estimate)).command.v, 0.0);
  estimate.X_WB.p.x() += 1.0;
  estimate.X_WB.q = from_rpy(0, 0, M_PI);
  EXPECT_NEAR(surface.step(input(1, estimate)).command.v, 0.2, 1e-9);
  BehaviorInput blind = input(2, estimate);
  blind.attitude_known = false;
  EXPECT_EQ(surface.step(blind).command.v, 0.0);
}

}  // namespace
}  // namespace dive::behaviors
