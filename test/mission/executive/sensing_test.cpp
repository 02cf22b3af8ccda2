// Usability of sensors, decided once per tick from the arriving samples.

#include "mission/executive/sensing.h"

#include <cmath>
#include <limits>
#include <optional>

#include <gtest/gtest.h>

namespace dive::mission {
namespace {

constexpr Utime kTick = 20'000;

class SensingTest : public ::testing::Test {
 protected:
  SensingTest() { monitors_.start(0); }

  static behaviors::MonitorLimits limits() {
    behaviors::MonitorLimits limits;
    for (std::size_t i = 0; i < behaviors::kFailsafeCount; ++i) {
      limits.threshold[i] = behaviors::traits(static_cast<behaviors::FailsafeKind>(i)).threshold;
    }
    limits.max_depth = 30.0;
    limits.mission_timeout_s = 1000.0;
    return limits;
  }

  // One tick in which every working sensor sends the truth with a little noise.
  const SensorStatus& tick() {
    now_ += kTick;
    noise_ = -noise_;
    StepInputs inputs;
    inputs.now = now_;
    if (imu_works_) {
      ImuSample imu;
      imu.utime = now_;
      imu.q_WB = from_rpy(0.0, 0.0, imu_is_frozen_ ? 0.3 : 0.3 + noise_);
      imu.accel_B.z() = 9.81;
      inputs.imu = imu;
    }
    if (depth_works_) inputs.depth = DepthSample{now_, depth_m_ + noise_};
    inputs.health = HealthSample{now_, 0.8, 20.0, false};
    sensing_.update(inputs, monitors_, localization_);
    estimate_ = localization_.update(now_);
    behaviors::MonitorInput input;
    input.now = now_;
    input.estimate = &estimate_;
    static_cast<void>(monitors_.update(input));
    return sensing_.status();
  }

  const SensorStatus& run(double seconds) {
    for (const Utime end = now_ + from_seconds(seconds); now_ < end;) tick();
    return sensing_.status();
  }

  behaviors::Monitors monitors_{limits()};
  Localization localization_{Mission{}, {}, {0, 0, -3}, 0.05};
  Sensing sensing_;
  estimation::StateEstimate estimate_;
  Utime now_ = 0;
  double noise_ = 1e-4;
  double depth_m_ = 3.0;
  bool imu_works_ = true;
  bool imu_is_frozen_ = false;
  bool depth_works_ = true;
};

TEST_F(SensingTest, HasNoSensorBeforeTheFirstSamples) {
  imu_works_ = depth_works_ = false;
  EXPECT_FALSE(run(0.2).depth_is_fresh);
  EXPECT_EQ(sensing_.imu(), nullptr);
  EXPECT_FALSE(estimate_.valid);
  imu_works_ = depth_works_ = true;
  EXPECT_TRUE(tick().imu_is_fresh);
  EXPECT_TRUE(sensing_.status().depth_is_fresh);
  EXPECT_NEAR(sensing_.status().depth_m, 3.0, 1e-3);
  EXPECT_TRUE(estimate_.valid);
}

TEST_F(SensingTest, AttitudeIsStaleSoonerThanDepth) {
  run(1.0);
  imu_works_ = depth_works_ = false;
  EXPECT_TRUE(run(0.1).imu_is_fresh);
  EXPECT_FALSE(tick().imu_is_fresh);
  EXPECT_TRUE(run(0.38).depth_is_fresh);
  EXPECT_FALSE(tick().depth_is_fresh);
  EXPECT_NEAR(sensing_.status().depth_m, 3.0, 1e-3) << "the last one";
  imu_works_ = depth_works_ = true;
  tick();  // the failsafes consider the AHRS lost until this sample
  EXPECT_TRUE(tick().imu_is_fresh);
  EXPECT_TRUE(sensing_.status().depth_is_fresh);
}

TEST_F(SensingTest, ASampleThatCannotBeTrueDoesNotCount) {
  run(1.0);
  depth_m_ = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(run(0.54).depth_is_fresh);
  EXPECT_TRUE(std::isfinite(sensing_.status().depth_m));
}

// A frozen AHRS sends on time: its samples must not reach the estimate once it counts as lost.
TEST_F(SensingTest, AFrozenSensorIsNotUsedThoughItSends) {
  run(1.0);
  imu_is_frozen_ = true;
  EXPECT_TRUE(run(9.0).imu_is_fresh);
  EXPECT_FALSE(run(1.5).imu_is_fresh);
  imu_is_frozen_ = false;
  EXPECT_TRUE(run(0.1).imu_is_fresh);
}

TEST_F(SensingTest, AcceptsEachScanOnceAndNoneOfTheFuture) {
  const Utime now = from_seconds(10.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(sensing_.accept(now, planning::FreeAhead{now, nan}));
  EXPECT_FALSE(sensing_.accept(now, planning::FreeAhead{now + from_seconds(0.2), 5.0}));
  EXPECT_TRUE(sensing_.accept(now, planning::FreeAhead{now, 5.0}));
  EXPECT_FALSE(sensing_.accept(now, planning::FreeAhead{now, 5.0})) << "not newer";
  EXPECT_FALSE(sensing_.accept(now, planning::PoseCorrection{now, {nan, 0.0}}));
  EXPECT_FALSE(sensing_.accept(now, planning::PoseCorrection{now, {0.9, 0.9}})) << "too large";
  EXPECT_TRUE(sensing_.accept(now, planning::PoseCorrection{now, {0.1, 0.0}}))
      << "its own order, whatever other results of the scan came before";
  EXPECT_FALSE(sensing_.accept(now, planning::PoseCorrection{now - 1, {0.1, 0.0}}));
  EXPECT_TRUE(Sensing::accept(now, MapCorrection{{{1, {}}, {now, {}}}}));
  EXPECT_FALSE(Sensing::accept(now, MapCorrection{{{1, {}}, {now + 1, {}}}})) << "of the future";
  EXPECT_FALSE(Sensing::accept(now, MapCorrection{})) << "not well-formed";
}

}  // namespace
}  // namespace dive::mission
