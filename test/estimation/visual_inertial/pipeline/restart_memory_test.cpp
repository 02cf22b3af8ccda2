#include "estimation/visual_inertial/pipeline/restart_memory.h"

#include <gtest/gtest.h>

namespace dive::estimation {
namespace {

using Eigen::Vector3d;

constexpr Utime kBegin = 100 * kMicrosecondsPerSecond;

class RestartMemoryTest : public ::testing::Test {
 protected:
  /// The filter is healthy at `seconds`, with this bias of the gyro about x.
  void healthy_at(double seconds, double gyro_bias) {
    FilterState state(options_);
    ImuState imu;
    imu.gyro_bias.x() = gyro_bias;
    state.begin(imu, 1e-6 * Matrix15d::Identity());
    StateEstimate estimate;
    estimate.utime = kBegin + from_seconds(seconds);
    estimate.X_WB.p.x() = seconds;
    memory_.observe(estimate);
    memory_.remember(estimate.utime, state, estimate);
  }

  VisualInertialOptions options_;
  RestartMemory memory_{options_, KnownStart{}};
};

TEST_F(RestartMemoryTest, ProvesABiasByFiveSecondsOfHealth) {
  healthy_at(0.0, 0.01);
  EXPECT_FALSE(memory_.proven_bias());
  healthy_at(4.9, 0.02);
  EXPECT_FALSE(memory_.proven_bias());
  healthy_at(5.0, 0.03);
  ASSERT_TRUE(memory_.proven_bias());
  EXPECT_EQ(memory_.proven_bias()->gyro_B.x(), 0.01);
  EXPECT_EQ(memory_.proven_bias()->utime, kBegin);
}

TEST_F(RestartMemoryTest, KeepsWhatWasProvedUntilTheFilterHasProvedMore) {
  healthy_at(0.0, 0.01);
  healthy_at(5.0, 0.02);
  memory_.restart(true);
  healthy_at(6.0, 0.03);
  ASSERT_TRUE(memory_.proven_bias()) << "it may fail again at once";
  EXPECT_EQ(memory_.proven_bias()->gyro_B.x(), 0.01);
  memory_.restart(true);
  memory_.add({.utime = kBegin + from_seconds(7.0)});
  EXPECT_EQ(memory_.image_start().position_W.x(), 0.0) << "of the state that was proved";
  EXPECT_EQ(memory_.image_start().bias.gyro.x(), 0.01);
}

}  // namespace
}  // namespace dive::estimation
