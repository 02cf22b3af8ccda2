// The helm on the simulated vehicle: how it comes to rest by the estimated velocity, with and
// without attitude.

#include "mission/executive/control_stage.h"

#include <gtest/gtest.h>

#include "mission/executive/localization.h"
#include "test/vehicle/aqua2.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {
namespace {

using Eigen::Vector3d;
using vehicle::Simulator;

class HelmTest : public ::testing::TestWithParam<int> {
 protected:
  void tick() {
    const vehicle::SensorSamples samples = simulator_.step(control_.rates());
    if (!samples.depth) return;  // the first samples are still on their way
    const Utime now = simulator_.truth().utime;
    if (imu_works_ && samples.imu) {
      imu_ = *samples.imu;
      localization_.add(imu_);
    } else if (!imu_works_) {
      localization_.predict_attitude(now, control_.predicted());
    }
    localization_.add(*samples.depth);
    localization_.expect(control_.rates(), 0.0);
    estimate_ = localization_.update(now);
    control_.step(
        command_,
        {&imu_, imu_works_, samples.depth->depth_m, true, estimate_.v_WB_B, localization_.surge()},
        Simulator::kTick);
  }

  void swim(double seconds, double v, double yaw) {
    command_.v = v;
    command_.d = 5.0;
    command_.o = from_rpy(0.0, 0.0, yaw);
    for (int i = 0; i < static_cast<int>(seconds / Simulator::kTick); ++i) tick();
  }

  [[nodiscard]] const Vector3d& position() const { return simulator_.truth().X_WB.p; }

  Simulator simulator_{dive::testing::aqua2(),
                       Pose{{0, 0, -5}, Eigen::Quaterniond::Identity()},
                       {},
                       static_cast<std::uint64_t>(GetParam())};
  Localization localization_{Mission{}, {}, {0, 0, -5}, 0.05};
  ControlStage control_{vehicle::AutopilotOptions{}};
  estimation::StateEstimate estimate_;
  ImuSample imu_;
  vehicle::Command command_;
  bool imu_works_ = true;
};

// In a sharp turn the vehicle loses speed, which the autopilot's reference does not include: braked
// by the reference, it would back away at 0.08 m/s.
TEST_P(HelmTest, StopsAfterASharpTurnAndDoesNotBackAway) {
  swim(6.0, 0.4, 0.0);
  swim(4.0, 0.05, 2.6);
  swim(2.5, 0.4, 2.6);
  swim(5.0, 0.0, 2.6);
  EXPECT_LT(std::abs(simulator_.truth().v_WB_B.x()), 0.04);
}

// The force that pushes it then turns with it.
TEST_P(HelmTest, WithoutAttitudeItTurnsSlowlyAtItsDepth) {
  swim(6.0, 0.4, 0.0);
  swim(1.0, 0.4, 1.0);
  imu_works_ = false;
  swim(30.0, 0.0, 0.0);
  const double turn_rate = simulator_.truth().omega_WB_B.z();
  EXPECT_GT(turn_rate, 0.3);
  EXPECT_LT(turn_rate, 1.0);
  EXPECT_EQ(control_.rates().roll, 0.0);
  EXPECT_NEAR(control_.rates().surge, 0.0, 0.02);
  EXPECT_NEAR(position().z(), -5.0, 0.1);
}

TEST_P(HelmTest, WithoutAttitudeTheEstimateIsConsistent) {
  swim(6.0, 0.4, 0.0);
  swim(1.0, 0.4, 1.0);
  imu_works_ = false;
  swim(60.0, 0.0, 0.0);
  const double error = (position() - estimate_.X_WB.p).head<2>().norm();
  EXPECT_LT(error, 3.0 * estimation::horizontal_sigma(estimate_));
  EXPECT_GT(estimate_.covariance(5, 5), 1.0) << "the heading is unknown by now";
}

INSTANTIATE_TEST_SUITE_P(Seeds, HelmTest, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace dive::mission
