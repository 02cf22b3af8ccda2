// Faulty inputs: the filter must detect, count and survive them.

#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/common/sanitizers.h"
#include "test/estimation/visual_inertial/filter/filter_dive.h"
#include "test/estimation/visual_inertial/filter/sensor_faults.h"

namespace dive::estimation {
namespace {

using testing::AnalyticDive;
using testing::AnalyticDiveOptions;
using ::testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// A dive whose samples can be corrupted; 15 s unless a test changes it.
class SpoiledDive {
 public:
  explicit SpoiledDive(const AnalyticDiveOptions& of = {}) : options(of), dive(options, 61) {
    Random random(61);
    filter.emplace(testing::filter_options(dive, options), testing::known_start(dive, 0.0, random));
  }

  std::function<void(double, ImuSample&)> spoil_imu = [](double, ImuSample&) {};
  std::function<void(double, DepthSample&)> spoil_depth = [](double, DepthSample&) {};
  std::function<void(double, FeatureFrame&)> spoil_frame = [](double, FeatureFrame&) {};
  std::function<bool(double)> has_imu = [](double) { return true; };

  // Returns the final position error, m; demands finite values throughout.
  double go(double end = 15.0) {
    for (int tick = 0; 0.005 * tick <= end; ++tick) {
      const double t = 0.005 * tick;
      const Utime utime = 5'000 * tick;
      if (has_imu(t)) {
        ImuSample sample = dive.imu(utime);
        spoil_imu(t, sample);
        filter->add(sample);
      }
      if (tick % 20 == 0) {
        DepthSample sample = dive.depth(utime);
        spoil_depth(t, sample);
        filter->add(sample);
      }
      if (tick % 10 == 4) {
        FeatureFrame frame = dive.frame(utime);
        spoil_frame(t, frame);
        filter->add(frame);
      }
      const StateEstimate& estimate = filter->update(utime);
      EXPECT_TRUE(estimate.X_WB.is_finite() && estimate.covariance.allFinite()) << t;
      if (estimate.valid) {
        EXPECT_EQ(Matrix6d(estimate.covariance).llt().info(), Eigen::Success) << t;
      }
    }
    return testing::compare(filter->update(from_seconds(end)), dive.truth(end)).position.norm();
  }

  const InputFaults& faults() const { return filter->health().faults; }
  const FilterHealth& health() const { return filter->health(); }

  AnalyticDiveOptions options;
  AnalyticDive dive;
  std::optional<VisualInertialFilter> filter;
};

bool within(double t, double begin, double end) { return t >= begin && t < end; }

TEST(Faults, NoneAreCountedInAnOrdinaryDive) {
  SpoiledDive d;
  EXPECT_LT(d.go(), 0.1);
  EXPECT_EQ(d.faults().last, "");
  EXPECT_EQ(d.faults().late + d.faults().overflowed + d.faults().features_ignored, 0);
  EXPECT_NEAR(d.health().visual_innovation_ratio, 1.0, 0.3);
  EXPECT_LT(d.health().since_visual_s, 0.1);
}

TEST(Faults, NaNInTheImu) {
  SpoiledDive d;
  d.spoil_imu = [](double t, ImuSample& sample) {
    if (within(t, 5.0, 5.02)) sample.gyro_B.y() = kNaN;
    if (within(t, 6.0, 6.02)) sample.accel_B.x() = std::numeric_limits<double>::infinity();
  };
  EXPECT_LT(d.go(), 0.1);
  EXPECT_EQ(d.faults().imu_not_finite, 8);
  EXPECT_THAT(d.faults().last, HasSubstr("not finite"));
}

TEST(Faults, StampsOfTheImuThatRunBackOrRepeat) {
  SpoiledDive d;
  d.spoil_imu = [](double t, ImuSample& sample) {
    if (within(t, 5.0, 5.01)) sample.utime -= 100'000;
    if (within(t, 6.0, 6.001)) sample.utime -= 5'000;
    if (within(t, 7.0, 7.001)) sample.utime += 3'600'000'000;
  };
  EXPECT_LT(d.go(), 0.1);
  EXPECT_EQ(d.faults().imu_stamps, 4);
  EXPECT_THAT(d.faults().last, HasSubstr("stamp"));
}

TEST(Faults, ASaturatedGyro) {
  SpoiledDive d;
  d.spoil_imu = [](double t, ImuSample& sample) {
    if (within(t, 5.0, 5.1)) sample.gyro_B.z() = 100.0;
  };
  EXPECT_LT(d.go(), 0.3);
  EXPECT_EQ(d.faults().imu_saturated, 20);
  EXPECT_FALSE(d.health().diverged) << d.health().reason;
}

TEST(Faults, AGapInTheImu) {
  SpoiledDive d;
  d.has_imu = [](double t) { return !within(t, 5.0, 5.4); };
  EXPECT_LT(d.go(), 0.3);
  EXPECT_EQ(d.faults().imu_gaps, 1);
  EXPECT_FALSE(d.health().diverged) << d.health().reason;
}

TEST(Faults, AnImuThatFallsSilent) {
  SpoiledDive d;
  d.has_imu = [](double t) { return t < 5.0; };
  d.go(40.0);
  EXPECT_TRUE(d.health().diverged);
  EXPECT_THAT(d.health().reason, HasSubstr("no IMU"));
  EXPECT_GT(d.faults().overflowed, 0) << "memory is bounded";
}

TEST(Faults, ADepthThatJumpsForAWhile) {
  SpoiledDive d;
  d.spoil_depth = [](double t, DepthSample& sample) {
    if (within(t, 5.0, 7.0)) sample.depth_m += 1.5;
    if (within(t, 8.0, 8.1)) sample.depth_m = kNaN;
  };
  EXPECT_LT(d.go(), 0.1);
  EXPECT_EQ(d.faults().depth_refused, 20);
  EXPECT_EQ(d.faults().depth_not_finite, 1);
  EXPECT_FALSE(d.health().diverged) << d.health().reason;
}

TEST(Faults, ADepthThatStaysWrongIsRejectedWhileImagesAreGood) {
  SpoiledDive d;
  d.spoil_depth = [](double t, DepthSample& sample) {
    if (t > 5.0) sample.depth_m += 1.5;
  };
  EXPECT_LT(d.go(), 0.1);
  EXPECT_TRUE(d.health().depth_fault);
  EXPECT_TRUE(d.health().is_suspect);
  EXPECT_FALSE(d.health().diverged) << d.health().reason;
  EXPECT_THAT(d.faults().last, HasSubstr("the sensor is ignored"));
}

TEST(Faults, ADepthThatIsRightAgainIsTakenAgain) {
  SpoiledDive d;
  d.spoil_depth = [](double t, DepthSample& sample) {
    if (within(t, 4.0, 8.0)) sample.depth_m += 1.5;
  };
  EXPECT_LT(d.go(9.0), 0.1);
  EXPECT_FALSE(d.health().depth_fault);
  EXPECT_FALSE(d.health().diverged) << d.health().reason;
}

TEST(Faults, ADepthThatStaysWrongInTheDarkIsADivergence) {
  SpoiledDive d;
  d.spoil_depth = [](double t, DepthSample& sample) {
    if (t > 5.0) sample.depth_m += 4.0;
  };
  d.spoil_frame = [](double t, FeatureFrame& frame) {
    if (t > 5.0) frame.features.clear();
  };
  d.go(9.0);
  EXPECT_TRUE(d.health().diverged);
  EXPECT_FALSE(d.health().depth_fault);
  EXPECT_THAT(d.health().reason, HasSubstr("depth"));
}

TEST(Faults, EveryFaultIsReportedBeforeItIsFiveSigma) {
  DIVE_SKIP_UNDER_SANITIZERS("eight dives, and the faults above take each step");
  for (const std::string& fault : testing::sensor_faults()) {
    const testing::FaultDive dive = testing::dive_with(fault, 71);
    EXPECT_GT(dive.seconds, 10) << fault;
    EXPECT_EQ(dive.unreported, 0) << fault << ": " << dive.far << " s far";
  }
}

TEST(Faults, NothingIsReportedWithoutFaults) {
  const testing::FaultDive dive = testing::dive_with("none", 72);
  EXPECT_EQ(dive.far, 0);
  EXPECT_EQ(dive.flagged, 0) << dive.reason;
}

TEST(Faults, FramesThatAreLateOrSpoiled) {
  SpoiledDive d;
  d.spoil_frame = [](double t, FeatureFrame& frame) {
    if (within(t, 5.0, 5.05)) frame.utime -= 3'000'000;
    if (within(t, 6.0, 6.05)) frame.features.front().left.x() = kNaN;
    if (within(t, 7.0, 7.05)) frame.features.push_back(frame.features.front());
    if (within(t, 8.0, 8.05)) frame.features.clear();
  };
  EXPECT_LT(d.go(), 0.1);
  EXPECT_EQ(d.faults().late, 1);
  EXPECT_EQ(d.faults().features_ignored, 2);
}

TEST(Faults, FeaturesOfAnotherWorld) {
  SpoiledDive d;
  Random random(3);
  d.spoil_frame = [&](double t, FeatureFrame& frame) {
    if (t < 5.0) return;
    for (auto& feature : frame.features) {
      feature.left.x() += 0.1 * random.normal();
      feature.left.y() += 0.1 * random.normal();
      feature.right.reset();
    }
  };
  d.go();
  EXPECT_GT(d.health().visual.rejected + d.health().visual.untriangulated, 0);
  EXPECT_GT(d.health().since_visual_s, 1.0);
  EXPECT_TRUE(d.health().diverged || d.health().is_blind);
}

TEST(Faults, AnImuOfAnotherVehicle) {
  SpoiledDive d;
  d.spoil_imu = [](double t, ImuSample& sample) {
    if (t > 5.0) sample.accel_B = {20.0, 0.0, 0.0};
  };
  d.go();
  EXPECT_TRUE(d.health().diverged);
  EXPECT_NE(d.health().reason, "");
}

TEST(Faults, AreForgivenByAStart) {
  SpoiledDive d;
  d.spoil_imu = [](double t, ImuSample& sample) {
    if (within(t, 2.0, 5.0)) sample.accel_B = {20.0, 0.0, 0.0};
  };
  d.go(5.0);
  ASSERT_TRUE(d.health().diverged);
  d.filter->restart(ImageStart{});
  EXPECT_FALSE(d.health().diverged);
  EXPECT_FALSE(d.filter->update(6'000'000).valid);
}

}  // namespace
}  // namespace dive::estimation
