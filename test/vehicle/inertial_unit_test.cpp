#include "vehicle/simulator/sensors/inertial_unit.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "test/vehicle/aqua2.h"
#include "vehicle/simulator/simulator.h"

namespace dive::vehicle {
namespace {

using dive::testing::aqua2;
using dive::testing::ideal;
using Eigen::Vector3d;

constexpr ImuNoise kSilent{0, 0, 0, 0, 0, 0, 0, 0};
const Pose kStart{{1, 2, -5}, from_rpy(0.1, -0.2, 0.7)};

Conditions with(const ImuNoise& noise) {
  Conditions conditions = ideal();
  conditions.inertial_unit = noise;
  return conditions;
}

// Pseudo-rates of a dive that excites every motion.
PseudoRates rates_at(double t) {
  return {0.6 + 0.3 * std::sin(t), 0.2 * std::sin(0.7 * t), 0.3 * std::sin(1.3 * t),
          0.4 * std::sin(0.9 * t), 0.3 * std::cos(0.5 * t)};
}

// Strapdown integration by the midpoint rule from the true state after the first tick; in a
// current, which the IMU does not measure.
TEST(InertialUnit, NoiseFreeSamplesGiveTheTrueMotion) {
  Conditions conditions = with(kSilent);
  conditions.current_W = {0.2, -0.1, 0.05};
  Simulator sim(aqua2(), kStart, conditions, 1);
  ImuSample last = sim.step(rates_at(0)).inertial.samples[3];
  Pose X = sim.truth().X_WB;
  Vector3d v_W = X.q * sim.truth().v_WB_B;
  const Vector3d gravity_W(0, 0, -9.81);
  double swum = 0.0;
  for (int tick = 1; tick <= 500; ++tick) {
    const Vector3d before = sim.truth().X_WB.p;
    const SensorSamples samples = sim.step(rates_at(0.02 * tick));
    swum += (sim.truth().X_WB.p - before).norm();
    ASSERT_EQ(samples.inertial.count, 4U);
    for (const ImuSample& next : samples.inertial.list()) {
      ASSERT_EQ(next.utime - last.utime, 5000);
      const double dt = 0.005;
      const Eigen::Quaterniond q = X.q * so3_exp(0.5 * dt * (last.gyro_B + next.gyro_B));
      const Vector3d a_W = 0.5 * (X.q * last.accel_B + q * next.accel_B) + gravity_W;
      X.p += dt * v_W + 0.5 * dt * dt * a_W;
      v_W += dt * a_W;
      X.q = q.normalized();
      last = next;
    }
    ASSERT_EQ(last.utime, sim.truth().utime);
  }
  EXPECT_GT(swum, 4.0);
  EXPECT_LT((X.p - sim.truth().X_WB.p).norm(), 0.003);
  EXPECT_LT(angle_between(X.q, sim.truth().X_WB.q), 1e-3);
  EXPECT_LT((v_W - sim.truth().X_WB.q * sim.truth().v_WB_B).norm(), 0.003);
}

// Equal dives with and without the IMU give equal values in everything else.
TEST(InertialUnit, ChangesNothingElse) {
  Conditions conditions;
  Simulator without(aqua2(), kStart, conditions, 5);
  conditions.inertial_unit = ImuNoise{};
  Simulator sim(aqua2(), kStart, conditions, 5);
  for (int tick = 0; tick < 200; ++tick) {
    const SensorSamples a = without.step(rates_at(0.02 * tick));
    const SensorSamples b = sim.step(rates_at(0.02 * tick));
    ASSERT_EQ(without.truth().X_WB.p, sim.truth().X_WB.p);
    ASSERT_EQ(without.truth().X_WB.q.coeffs(), sim.truth().X_WB.q.coeffs());
    ASSERT_EQ(a.imu.has_value(), b.imu.has_value());
    ASSERT_EQ(a.inertial.count, 0U);
    if (!a.imu) continue;
    ASSERT_EQ(a.imu->gyro_B, b.imu->gyro_B);
    ASSERT_EQ(a.imu->accel_B, b.imu->accel_B);
    ASSERT_EQ(a.depth->depth_m, b.depth->depth_m);
    ASSERT_EQ(b.inertial.samples[3].utime, b.imu->utime);  // the same latency as the rest
  }
}

// By definition, the mean over T of white noise of density N has the variance N^2 / T.
TEST(InertialUnit, NoiseHasItsDensity) {
  ImuNoise figures = kSilent;
  figures.gyro_density = 2e-4;
  figures.accel_density = 1e-3;
  for (const int averaged : {1, 40}) {
    InertialUnit unit(figures, 3, 0.005);
    double gyro = 0.0;
    double accel = 0.0;
    constexpr int kGroups = 3000;
    for (int group = 0; group < kGroups; ++group) {
      Vector3d g = Vector3d::Zero();
      Vector3d a = Vector3d::Zero();
      for (int i = 0; i < averaged; ++i) {
        ImuSample sample;
        unit.measure(Vector3d(0.1, 0, 0), Vector3d(0, 0, 9.81), sample);
        g += (sample.gyro_B - Vector3d(0.1, 0, 0)) / averaged;
        a += (sample.accel_B - Vector3d(0, 0, 9.81)) / averaged;
      }
      gyro += g.squaredNorm() / (3 * kGroups);
      accel += a.squaredNorm() / (3 * kGroups);
    }
    const double seconds = 0.005 * averaged;
    const double tolerance = 5.0 * std::sqrt(2.0 / (3 * kGroups));
    EXPECT_NEAR(gyro / (2e-4 * 2e-4 / seconds), 1.0, tolerance);
    EXPECT_NEAR(accel / (1e-3 * 1e-3 / seconds), 1.0, tolerance);
  }
}

// After a time T the biases of many IMUs have spread by the variance walk^2 T.
TEST(InertialUnit, BiasesWalk) {
  ImuNoise figures;
  figures.gyro_bias_sigma = 1e-3;
  figures.gyro_walk = 2e-4;
  figures.accel_bias_sigma = 0.02;
  figures.accel_walk = 5e-3;
  double gyro = 0.0;
  double accel = 0.0;
  constexpr int kUnits = 400;
  for (int seed = 0; seed < kUnits; ++seed) {
    InertialUnit unit(figures, static_cast<std::uint64_t>(seed), 0.005);
    ImuSample sample;
    for (int i = 0; i < 2000; ++i) unit.measure(Vector3d::Zero(), Vector3d::Zero(), sample);
    gyro += unit.gyro_bias().squaredNorm() / (3 * kUnits);
    accel += unit.accel_bias().squaredNorm() / (3 * kUnits);
  }
  const double tolerance = 5.0 * std::sqrt(2.0 / (3 * kUnits));
  EXPECT_NEAR(gyro / (1e-6 + 10.0 * 4e-8), 1.0, tolerance);
  EXPECT_NEAR(accel / (4e-4 + 10.0 * 2.5e-5), 1.0, tolerance);
}

TEST(InertialUnit, RefusesFiguresOfNoUnit) {
  EXPECT_EQ(ImuNoise{}.validate(), "");
  ImuNoise bad;
  bad.gyro_walk = -1e-9;
  EXPECT_NE(bad.validate().find("gyro_walk"), std::string::npos);
  bad = {};
  bad.accel_density = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(bad.validate(), "");
  Conditions conditions;
  conditions.inertial_unit = bad;
  EXPECT_NE(conditions.validate(), "");
}

}  // namespace
}  // namespace dive::vehicle
