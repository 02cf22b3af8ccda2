// Estimator, follower and autopilot against the simulator: consistency of the covariance, and true
// distance of the vehicle from its path. The estimator's motion model and the simulator's equations
// are independent code; this test compares them.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "common/random.h"
#include "estimation/primitive.h"
#include "test/vehicle/aqua2.h"
#include "vehicle/autopilot.h"
#include "vehicle/follower.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;
using vehicle::Conditions;
using vehicle::Simulator;

constexpr double kStartSigma = 0.05;  // m, of the position of release

// From open water through a window and round into the next room: 16 m.
std::vector<Vector3d> way_in() {
  return {{-4, -2, -3},     {-2.5, -2, -3.5},  {-1, -2, -4},      {0.5, -1.8, -4.1},
          {2, -1.2, -4.2},  {3.4, -0.2, -4.3}, {4.7, 1.0, -4.4},  {6.1, 1.6, -4.5},
          {7.4, 0.9, -4.6}, {8.4, -0.3, -4.6}, {9.3, -1.5, -4.6}, {9.8, -2, -4.6}};
}

struct Dive {
  Dive(const Conditions& conditions, std::uint64_t seed, const Vector3d& start)
      : sim(testing::aqua2(), {start, Eigen::Quaterniond::Identity()}, conditions, seed),
        estimator({}, believed_start(start, seed), kStartSigma) {
    command.d = -start.z();
  }

  static Vector3d believed_start(const Vector3d& start, std::uint64_t seed) {
    Random random(seed, 0x57a47);
    return start + kStartSigma * Vector3d(random.normal(), random.normal(), 0.0);
  }

  void tick() {
    const vehicle::SensorSamples samples = sim.step(rates);
    if (samples.imu) estimator.add(*samples.imu);
    if (samples.depth) estimator.add(*samples.depth);
    estimator.set_efforts(rates.surge, rates.heave);
    estimate = estimator.update(sim.truth().utime);
    if (!estimate.valid) return;
    if (follower.has_path()) command = follower.step(estimate.X_WB, estimate.v_WB_B);
    rates = autopilot.step(command, samples.imu->q_WB, samples.imu->gyro_B, samples.depth->depth_m,
                           Simulator::kTick);
  }

  // Follows the path to its end; returns the largest true distance to it.
  double follow(const std::vector<Pose>& path) {
    follower.set_path(path, estimate.valid ? estimate.X_WB.p : path.front().p);
    double worst = 0.0;
    for (int i = 0; i < 10'000 && !follower.status().finished; ++i) {
      tick();
      worst = std::max(worst, testing::distance_to_polyline(path, sim.truth().X_WB.p));
    }
    EXPECT_TRUE(follower.status().finished && !follower.status().missed);
    return worst;
  }

  [[nodiscard]] Vector3d error() const { return sim.truth().X_WB.p - estimate.X_WB.p; }
  [[nodiscard]] double nees() const {
    return error().dot(estimate.covariance.topLeftCorner<3, 3>().inverse() * error());
  }

  Simulator sim;
  PrimitiveEstimator estimator;
  vehicle::Autopilot autopilot{vehicle::AutopilotOptions{}};
  vehicle::Follower follower{vehicle::FollowerOptions{}};
  vehicle::Command command;
  vehicle::PseudoRates rates;
  StateEstimate estimate;
};

std::vector<Pose> reversed(std::vector<Vector3d> points) {
  std::reverse(points.begin(), points.end());
  return testing::level_path(points);
}

TEST(MotionModel, ExpectsTheSimulatorsSpeedThroughStartsTurnsAndStops) {
  Dive dive(testing::ideal(), 1, {0, 0, -5});
  double worst_surge = 0.0;
  double worst_sway = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.02 * i;
    dive.command.v = t < 20.0 ? 0.4 : t < 40.0 ? 0.6 : 0.1;
    dive.command.o = from_rpy(0.0, 0.0, 0.25 * std::max(t - 10.0, 0.0));
    dive.tick();
    if (!dive.estimate.valid) continue;
    const Vector3d off = dive.sim.truth().v_WB_B - dive.estimate.v_WB_B;
    worst_surge = std::max(worst_surge, std::abs(off.x()));
    worst_sway = std::max(worst_sway, std::abs(off.y()));
  }
  EXPECT_LT(worst_surge, 0.03);
  EXPECT_LT(worst_sway, 0.03);
  EXPECT_LT(dive.error().head<2>().norm(), 0.01 * dive.sim.truth().distance_swum_m);
}

// Pitched, rolled and heaving at once, turns exchange momentum between all axes.
TEST(MotionModel, ExpectsTheSimulatorsVelocityThroughPitchingAndRolling) {
  Dive dive(testing::ideal(), 1, {0, 0, -10});
  Vector3d worst = Vector3d::Zero();
  for (int i = 0; i < 3500; ++i) {
    const double t = 0.02 * i;
    dive.command.v = t < 10.0 || t > 60.0 ? 0.0 : 0.4;
    dive.command.d = t < 20.0 ? 10.0 : t < 30.0 ? 8.0 : t < 50.0 ? 9.0 : 6.0;
    const double roll = t > 30.0 && t < 45.0 ? 80.0 : 0.0;
    const double pitch = t > 20.0 && t < 25.0 ? -30.0 : t > 50.0 && t < 58.0 ? -50.0 : 0.0;
    dive.command.o = from_rpy(deg_to_rad(roll), deg_to_rad(pitch), t > 35.0 ? 0.5 : 0.0);
    dive.tick();
    if (!dive.estimate.valid) continue;
    worst = worst.cwiseMax((dive.sim.truth().v_WB_B - dive.estimate.v_WB_B).cwiseAbs());
  }
  EXPECT_LT(worst.x(), 0.03);
  EXPECT_LT(worst.y(), 0.03);
  EXPECT_LT(worst.z(), 0.05);
  EXPECT_LT(dive.error().head<2>().norm(), 0.3);
}

TEST(PrimitiveEstimator, IsConsistentOverManyDives) {
  constexpr int kDives = 60;
  std::array<double, 3> nees{};  // after 20 s, at the far end, and back at the start
  for (int seed = 1; seed <= kDives; ++seed) {
    const std::vector<Pose> path = testing::level_path(way_in());
    Dive dive(Conditions{}, static_cast<std::uint64_t>(seed), path.front().p);
    dive.follower.set_path(path, path.front().p);
    for (int i = 0; i < 1000; ++i) dive.tick();
    nees[0] += dive.nees() / kDives;
    static_cast<void>(dive.follow(path));
    nees[1] += dive.nees() / kDives;
    static_cast<void>(dive.follow(reversed(way_in())));
    nees[2] += dive.nees() / kDives;
  }
  // The mean of 60 chi-squares of 3 degrees of freedom: 95 % lie within 2.41 and 3.65.
  for (const double mean : nees) EXPECT_LT(mean, 3.65) << "overconfident";
  EXPECT_GT(nees[0], 1.8) << "far too cautious";
  EXPECT_GT(nees[1], 1.8) << "far too cautious";
  RecordProperty("nees", std::to_string(nees[0]) + " " + std::to_string(nees[1]) + " " +
                             std::to_string(nees[2]));
}

/// A vehicle that has been calibrated, in a pool.
Conditions pool() {
  Conditions conditions = testing::ideal();
  conditions.speed_scale_sigma = 0.01;
  conditions.heading_bias_sigma_deg = 0.5;
  conditions.attitude_noise_deg = 0.1;
  conditions.gyro_noise = 0.01;
  conditions.accel_noise = 0.01;
  conditions.depth_noise_m = 0.01;
  conditions.sensor_latency_s = 0.02;
  return conditions;
}

TEST(ClosedLoop, OutAndBackInPoolConditions) {
  double worst_deviation = 0.0;
  double worst_end = 0.0;
  double mean_end = 0.0;
  double least_distance = 1e9;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const std::vector<Pose> path = testing::level_path(way_in());
    Dive dive(pool(), seed, path.front().p);
    worst_deviation = std::max(worst_deviation, dive.follow(path));
    static_cast<void>(dive.follow(reversed(way_in())));
    worst_end = std::max(worst_end, dive.error().norm());
    mean_end += dive.error().norm() / 20.0;
    least_distance = std::min(least_distance, dive.sim.truth().distance_swum_m);
  }
  RecordProperty("worst_deviation_m", std::to_string(worst_deviation));
  RecordProperty("worst_end_error_m", std::to_string(worst_end));
  EXPECT_GT(least_distance, 31.0);
  // A path certified at 1.0 m of clearance keeps 0.5 m.
  EXPECT_LT(worst_deviation, 0.45);
  EXPECT_LT(worst_end, 0.35);
  EXPECT_LT(mean_end, 0.15);
}

}  // namespace
}  // namespace dive::estimation
