#include "vehicle/simulator/simulator.h"

#include <cmath>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/assert.h"
#include "test/common/allocations.h"
#include "test/vehicle/aqua2.h"

namespace dive::vehicle {
namespace {

using Eigen::Vector3d;
using testing::aqua2;
using testing::ideal;

const Pose kFiveMetresDown{{0.0, 0.0, -5.0}, Eigen::Quaterniond::Identity()};

Simulator simulator(const Conditions& conditions, std::uint64_t seed = 1,
                    const Pose& start = kFiveMetresDown) {
  return Simulator(aqua2(), start, conditions, seed);
}

void swim(Simulator& sim, const PseudoRates& rates, double seconds) {
  for (int i = 0; i < static_cast<int>(seconds / Simulator::kTick); ++i) {
    static_cast<void>(sim.step(rates));
  }
}

struct Moments {
  double mean = 0.0;
  double sigma = 0.0;
};

Moments moments(const std::vector<double>& values) {
  Moments result;
  for (const double value : values) result.mean += value / static_cast<double>(values.size());
  for (const double value : values) {
    result.sigma += std::pow(value - result.mean, 2) / static_cast<double>(values.size() - 1);
  }
  result.sigma = std::sqrt(result.sigma);
  return result;
}

TEST(Simulator, SwimsAtEightyCentimetresPerSecondFlatOut) {
  Simulator sim = simulator(ideal());
  swim(sim, {1.0, 0.0, 0.0, 0.0, 0.0}, 30.0);
  EXPECT_NEAR(sim.truth().v_WB_B.x(), 0.8, 0.01);
  EXPECT_NEAR(std::abs(sim.truth().X_WB.p.y()), 0.0, 0.05);
}

TEST(Simulator, SpeedGoesWithTheRootOfTheThrust) {
  Simulator sim = simulator(ideal());
  swim(sim, {0.25, 0.0, 0.0, 0.0, 0.0}, 60.0);
  EXPECT_NEAR(sim.truth().v_WB_B.x(), 0.4, 0.01);
}

TEST(Simulator, CannotFly) {
  Simulator sim = simulator(ideal());
  double highest = -5.0;
  for (int i = 0; i < 3000; ++i) {
    static_cast<void>(sim.step({0.0, 1.0, 0.0, 0.0, 0.0}));
    highest = std::max(highest, sim.truth().X_WB.p.z());
  }
  EXPECT_GT(highest, -0.2) << "it did reach the surface";
  EXPECT_LT(highest, 0.15) << "and could not leave the water";
}

TEST(Simulator, TheSameSeedGivesTheSameDiveAndAnotherSeedAnother) {
  Simulator a = simulator(Conditions{}, 7);
  Simulator b = simulator(Conditions{}, 7);
  Simulator c = simulator(Conditions{}, 8);
  bool differs = false;
  for (int i = 0; i < 500; ++i) {
    const PseudoRates rates{0.3, 0.1, 0.0, 0.05, std::sin(0.02 * i)};
    const SensorSamples x = a.step(rates);
    const SensorSamples y = b.step(rates);
    const SensorSamples z = c.step(rates);
    ASSERT_EQ(x.imu.has_value(), y.imu.has_value());
    if (!x.imu) continue;
    ASSERT_EQ(x.imu->q_WB.coeffs(), y.imu->q_WB.coeffs());
    ASSERT_EQ(x.imu->accel_B, y.imu->accel_B);
    ASSERT_EQ(x.depth->depth_m, y.depth->depth_m);
    differs = differs || x.depth->depth_m != z.depth->depth_m;
  }
  EXPECT_EQ(a.truth().X_WB.p, b.truth().X_WB.p);
  EXPECT_TRUE(differs);
}

TEST(Simulator, ACurrentSetDuringTheDiveTakesTheVehicleAlong) {
  Simulator sim = simulator(ideal());
  swim(sim, {}, 1.0);
  const Vector3d before = sim.truth().v_WB_B;
  sim.set_current({0.0, 0.3, 0.0});
  swim(sim, {}, 0.02);
  EXPECT_LT((sim.truth().v_WB_B - before).norm(), 0.02) << "but not with a jerk";
  swim(sim, {}, 60.0);
  EXPECT_NEAR((sim.truth().X_WB.q * sim.truth().v_WB_B).y(), 0.3, 0.02);
}

TEST(Simulator, TheDeclaredCurrentFlowsAndAnotherOnTop) {
  Conditions conditions = ideal();
  conditions.declared_current =
      DeclaredCurrent({{0.0, {0.1, 0.0}}, {60.0, {0.1, 0.0}}, {120.0, {-0.3, 0.0}}});
  conditions.current_W = {0.0, 0.05, 0.0};
  Simulator sim = simulator(conditions);
  constexpr double kSlip = 0.025;  // m/s: at low speed the water takes the vehicle along slowly
  const auto velocity_W = [&] { return Vector3d(sim.truth().X_WB.q * sim.truth().v_WB_B); };
  EXPECT_LT((velocity_W() - Vector3d(0.1, 0.05, 0.0)).norm(), 1e-9) << "released in the water";
  swim(sim, {}, 60.0);
  EXPECT_NEAR(velocity_W().x(), 0.1, 1e-3);
  EXPECT_NEAR(velocity_W().y(), 0.05, 1e-3);
  swim(sim, {}, 160.0);
  EXPECT_NEAR(velocity_W().x(), -0.3, kSlip);
  EXPECT_NEAR(velocity_W().y(), 0.05, kSlip);
  sim.set_current({0.0, 0.0, 0.0});
  swim(sim, {}, 160.0);
  EXPECT_NEAR(velocity_W().x(), -0.3, kSlip) << "a script sets what is on top";
  EXPECT_NEAR(velocity_W().y(), 0.0, kSlip);
}

TEST(Sensors, AtRestMeasureGravityUpAndNothingElse) {
  Simulator sim = simulator(ideal(), 1, {{0, 0, -5}, from_rpy(0.0, 0.0, 2.0)});
  const SensorSamples samples = sim.step({});
  ASSERT_TRUE(samples.imu && samples.depth && samples.health);
  EXPECT_NEAR((samples.imu->accel_B - Vector3d(0, 0, 9.81)).norm(), 0.0, 0.05);
  EXPECT_LT(samples.imu->gyro_B.norm(), 1e-3);
  EXPECT_NEAR(samples.depth->depth_m, 5.0, 1e-3);
}

TEST(Sensors, NoiseAndBiasHaveTheSizeAskedFor) {
  Conditions conditions;
  conditions.heading_variation_deg = 0.0;
  conditions.tilt_bias_sigma_deg = 0.0;
  conditions.gyro_bias_sigma = 0.0;
  conditions.depth_bias_sigma_m = 0.0;
  std::vector<double> biases;
  std::vector<double> depth_errors;
  std::vector<double> gyro_errors;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    Simulator sim = simulator(conditions, seed);
    std::vector<double> yaw_errors;
    for (int i = 0; i < 20; ++i) {
      const GroundTruth before = sim.truth();  // the latency is one tick
      const SensorSamples samples = sim.step({});
      if (!samples.imu) continue;
      ASSERT_EQ(samples.imu->utime, before.utime);
      yaw_errors.push_back(to_rpy(samples.imu->q_WB).z() - to_rpy(before.X_WB.q).z());
      depth_errors.push_back(samples.depth->depth_m + before.X_WB.p.z());
      gyro_errors.push_back(samples.imu->gyro_B.y() - before.omega_WB_B.y());
    }
    EXPECT_NEAR(rad_to_deg(moments(yaw_errors).sigma), 0.1, 0.1);
    biases.push_back(rad_to_deg(moments(yaw_errors).mean));
  }
  EXPECT_NEAR(moments(biases).mean, 0.0, 0.1);
  EXPECT_NEAR(moments(biases).sigma, conditions.heading_bias_sigma_deg, 0.16);
  EXPECT_NEAR(moments(depth_errors).sigma, conditions.depth_noise_m, 5e-4);
  EXPECT_NEAR(moments(gyro_errors).sigma, conditions.gyro_noise, 5e-4);
}

TEST(Sensors, TheGaitsSpeedIsOffByTheScaleAskedFor) {
  Conditions conditions = ideal();
  conditions.speed_scale_sigma = 0.05;
  std::vector<double> scales;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Simulator sim = simulator(conditions, seed);
    swim(sim, {0.25, 0.0, 0.0, 0.0, 0.0}, 25.0);
    scales.push_back(sim.truth().v_WB_B.x() / 0.4);
  }
  EXPECT_NEAR(moments(scales).mean, 1.0, 0.012);
  EXPECT_NEAR(moments(scales).sigma, 0.05, 0.008);
}

TEST(Sensors, ArriveAfterTheirLatencyWithTheTimeAtWhichTheyWereTaken) {
  Conditions conditions = ideal();
  conditions.sensor_latency_s = 0.1;
  Simulator sim = simulator(conditions);
  for (int tick = 1; tick <= 20; ++tick) {
    const SensorSamples samples = sim.step({});
    if (tick <= 5) {
      EXPECT_FALSE(samples.imu || samples.depth);
    } else {
      ASSERT_TRUE(samples.imu && samples.depth);
      EXPECT_EQ(samples.imu->utime, (tick - 5) * 20'000);
      EXPECT_EQ(samples.depth->utime, (tick - 5) * 20'000);
    }
  }
}

TEST(Health, ReportsTheBatteryRunningDown) {
  Conditions conditions = ideal();
  conditions.battery_capacity_wh = 1.0;
  Simulator sim = simulator(conditions);
  int reports = 0;
  double fraction = 1.0;
  for (int tick = 0; tick < 500; ++tick) {
    const SensorSamples samples = sim.step({1.0, 0.0, 0.0, 0.0, 0.0});
    if (!samples.health) continue;
    ++reports;
    EXPECT_FALSE(samples.health->leak);
    EXPECT_LT(samples.health->battery_fraction, fraction);
    fraction = samples.health->battery_fraction;
  }
  EXPECT_EQ(reports, 10);
  EXPECT_NEAR(1.0 - fraction, sim.truth().energy_used_wh, 0.02);
  // 25 W of hotel load and 45 W of thrust for ten seconds.
  EXPECT_NEAR(sim.truth().energy_used_wh, 70.0 * 10.0 / 3600.0, 0.01);
}

TEST(Simulator, AllocatesNothingPerStep) {
  Simulator sim = simulator(Conditions{});
  testing::reset_allocations();
  swim(sim, {0.5, 0.2, 0.1, 0.1, 0.4}, 5.0);
  EXPECT_EQ(testing::allocations().count, 0U);
}

TEST(Simulator, RefusesConditionsThatAreNone) {
  Conditions conditions;
  conditions.sensor_latency_s = 5.0;
  EXPECT_THROW(simulator(conditions), AssertionFailure);
}

TEST(Conditions, AreSetAndListedByTheSameNames) {
  Conditions conditions;
  double value = 0.01;
  for (const auto& [name, unused] : conditions.list()) {
    ASSERT_TRUE(conditions.set(name, value)) << name;
    value += 0.01;
  }
  value = 0.01;
  for (const auto& [name, listed] : conditions.list()) {
    EXPECT_DOUBLE_EQ(listed, value) << name;
    value += 0.01;
  }
  EXPECT_FALSE(conditions.set("curent_x", 0.1));
}

TEST(Conditions, ReportWhatIsWrongWithThem) {
  EXPECT_EQ(Conditions{}.validate(), "");
  for (const auto& [name, unused] : Conditions{}.list()) {
    for (const double bad : {std::nan(""), 1e9, -1e9}) {
      Conditions conditions;
      ASSERT_TRUE(conditions.set(name, bad));
      EXPECT_THAT(conditions.validate(), ::testing::StartsWith(name)) << bad;
    }
  }
}

}  // namespace
}  // namespace dive::vehicle
