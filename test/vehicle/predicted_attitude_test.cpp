// Compares the prediction with the simulated vehicle.

#include "vehicle/predicted_attitude.h"

#include <gtest/gtest.h>

#include "common/se3.h"
#include "test/vehicle/aqua2.h"
#include "vehicle/simulator/simulator.h"

namespace dive::vehicle {
namespace {

// Rotates from rest under one effort.
TEST(PredictedAttitude, FollowsTheVehicleForASecond) {
  for (int axis = 0; axis < 3; ++axis) {
    Simulator simulator(dive::testing::aqua2(), Pose{{0, 0, -5}, Eigen::Quaterniond::Identity()},
                        {}, 1);
    PredictedAttitude reckoned;
    reckoned.start(simulator.truth().X_WB.q, simulator.truth().omega_WB_B);
    PseudoRates rates;
    (axis == 0 ? rates.roll : axis == 1 ? rates.pitch : rates.yaw) = 0.5;
    for (int tick = 0; tick < 50; ++tick) {
      static_cast<void>(simulator.step(rates));
      reckoned.advance(rates, Simulator::kTick);
    }
    const double turned = angle_between(Eigen::Quaterniond::Identity(), simulator.truth().X_WB.q);
    const double error = angle_between(reckoned.q_WB(), simulator.truth().X_WB.q);
    EXPECT_GT(turned, 0.15) << "axis " << axis;
    EXPECT_LT(error, 0.5 * turned) << "axis " << axis;
  }
}

// Fast enough for drag to matter.
TEST(PredictedAttitude, FollowsTheVehicleThroughATurn) {
  Simulator simulator(dive::testing::aqua2(), Pose{{0, 0, -5}, Eigen::Quaterniond::Identity()}, {},
                      1);
  PredictedAttitude reckoned;
  reckoned.start(simulator.truth().X_WB.q, simulator.truth().omega_WB_B);
  PseudoRates rates;
  rates.yaw = 0.6;
  for (int tick = 0; tick < 125; ++tick) {
    static_cast<void>(simulator.step(rates));
    reckoned.advance(rates, Simulator::kTick);
  }
  EXPECT_GT(to_rpy(simulator.truth().X_WB.q).z(), 1.2);
  EXPECT_LT(angle_between(reckoned.q_WB(), simulator.truth().X_WB.q), 0.25);
}

TEST(PredictedAttitude, IsNotTrustedForLong) {
  PredictedAttitude reckoned;
  reckoned.start(from_rpy(0.5, 0, 1), Eigen::Vector3d::Zero());
  EXPECT_NEAR(reckoned.tilt(), 0.5, 1e-12);
  reckoned.advance({}, 3.9);
  EXPECT_TRUE(reckoned.is_trusted());
  reckoned.advance({}, 0.2);
  EXPECT_FALSE(reckoned.is_trusted());
}

}  // namespace
}  // namespace dive::vehicle
