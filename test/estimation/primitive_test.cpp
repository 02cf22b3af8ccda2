// The estimator alone, with inputs written here.

#include "estimation/primitive.h"

#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "common/assert.h"
#include "test/common/allocations.h"
#include "test/common/arbitrary.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr Utime kTick = 20'000;

ImuSample imu(Utime utime, const Eigen::Quaterniond& q_WB,
              const Vector3d& gyro_B = Vector3d::Zero()) {
  ImuSample sample;
  sample.utime = utime;
  sample.q_WB = q_WB;
  sample.gyro_B = gyro_B;
  return sample;
}

PrimitiveEstimator estimator(const PrimitiveOptions& options = {}) {
  return PrimitiveEstimator(options, {1.0, 2.0, -3.0}, 0.05);
}

// Swims on one heading, level, at constant depth; returns the time at the end.
Utime swim(PrimitiveEstimator& estimator, Utime from, double heading, double speed,
           double seconds) {
  const Utime end = from + from_seconds(seconds);
  estimator.set_commanded_speed(speed);
  for (Utime now = from + kTick; now <= end; now += kTick) {
    estimator.add(imu(now, from_rpy(0.0, 0.0, heading)));
    estimator.add(DepthSample{now, 3.0});
    static_cast<void>(estimator.update(now));
  }
  return end;
}

TEST(PrimitiveEstimator, IsInvalidUntilAttitudeAndDepthHaveCome) {
  PrimitiveEstimator e = estimator();
  EXPECT_FALSE(e.update(0).valid);
  e.add(imu(kTick, Eigen::Quaterniond::Identity()));
  EXPECT_FALSE(e.update(kTick).valid);
  e.add(DepthSample{2 * kTick, 3.5});
  const StateEstimate& estimate = e.update(2 * kTick);
  EXPECT_TRUE(estimate.valid);
  EXPECT_EQ(estimate.source, EstimatorKind::kPrimitive);
  EXPECT_EQ(estimate.utime, 2 * kTick);
  EXPECT_NEAR((estimate.X_WB.p - Vector3d(1.0, 2.0, -3.5)).norm(), 0.0, 1e-12);
}

TEST(PrimitiveEstimator, DeadReckonsAlongItsHeading) {
  PrimitiveEstimator e = estimator();
  const double heading = deg_to_rad(30.0);
  Utime now = swim(e, 0, heading, 0.4, 20.0);
  const Vector3d before = e.update(now).X_WB.p;
  now = swim(e, now, heading, 0.4, 10.0);
  const Vector3d way = e.update(now).X_WB.p - before;
  EXPECT_NEAR((way - 4.0 * Vector3d(std::cos(heading), std::sin(heading), 0.0)).norm(), 0.0, 0.02);
  EXPECT_NEAR(e.update(now).v_WB_B.x(), 0.4, 1e-3);
}

// A vehicle at rest in the water is carried; one that swims adds its own motion.
TEST(PrimitiveEstimator, IsCarriedByTheCurrentOfEachMoment) {
  PrimitiveOptions options;
  options.current_sigma = 0.03;
  PrimitiveEstimator carried = estimator(options);
  PrimitiveEstimator in_still_water = estimator();
  const double heading = deg_to_rad(30.0);
  carried.set_current({0.1, 0.0});
  Utime now = swim(carried, 0, heading, 0.4, 20.0);
  carried.set_current({0.0, -0.2});
  now = swim(carried, now, heading, 0.4, 10.0);
  swim(in_still_water, 0, heading, 0.4, 30.0);
  const StateEstimate& estimate = carried.update(now);
  const StateEstimate& still = in_still_water.update(now);
  const Vector3d by = estimate.X_WB.p - still.X_WB.p;
  EXPECT_LT((by - Vector3d(2.0, -2.0, 0.0)).norm(), 0.01);
  const Vector3d v_W = estimate.X_WB.q * (estimate.v_WB_B - still.v_WB_B);
  EXPECT_LT((v_W - Vector3d(0.0, -0.2, 0.0)).norm(), 1e-9) << "over ground";
  EXPECT_DOUBLE_EQ(carried.v_B().x(), in_still_water.v_B().x()) << "through the water";
  const Eigen::Matrix2d grown = (estimate.covariance - still.covariance).topLeftCorner<2, 2>();
  EXPECT_LT((grown - 0.9 * 0.9 * Eigen::Matrix2d::Identity()).norm(), 0.01) << "30 s of 0.03 m/s";
}

// Against two estimators whose vehicles are faster and slower by a share of one in a thousand,
// while it swims, brakes by its flippers and coasts.
TEST(PrimitiveEstimator, KnowsWhatAnErrorOfTheFullSpeedDoes) {
  constexpr double kShare = 1e-3;
  const auto with = [](double full_speed_factor) {
    PrimitiveOptions options;
    options.motion.full_speed *= full_speed_factor;
    return estimator(options);
  };
  PrimitiveEstimator slower = with(1.0 - kShare);
  PrimitiveEstimator e = with(1.0);
  PrimitiveEstimator faster = with(1.0 + kShare);
  const double heading = deg_to_rad(30.0);
  const Vector2d start(1.0, 2.0);
  Utime now = 0;
  const auto run = [&](double effort, double seconds) {
    const Utime end = now + from_seconds(seconds);
    for (now += kTick; now <= end; now += kTick) {
      for (PrimitiveEstimator* each : {&slower, &e, &faster}) {
        each->set_efforts(effort, 0.0);
        each->add(imu(now, from_rpy(0.0, 0.0, heading)));
        each->add(DepthSample{now, 3.0});
        static_cast<void>(each->update(now));
      }
    }
    now = end;
  };
  const auto expect = [&](const char* what) {
    const StateEstimate& fast = faster.update(now);
    const StateEstimate& slow = slower.update(now);
    const Vector2d moved = (fast.X_WB.p - slow.X_WB.p).head<2>() / (2.0 * kShare);
    const double velocity = (faster.v_B() - slower.v_B()).x() / (2.0 * kShare);
    const Vector2d by_scale = e.update(now).X_WB.p.head<2>() - start + e.errors().excess_W;
    EXPECT_LT((by_scale - moved).norm(), 0.02 + 0.03 * moved.norm()) << what;
    EXPECT_NEAR(e.by_scale_B().x(), velocity, 0.02) << what;
  };
  run(0.25, 20.0);
  expect("steady");
  EXPECT_NEAR(e.by_scale_B().x(), 0.4, 0.01);
  EXPECT_LT(e.errors().excess_velocity_W.norm(), 0.01);
  run(-0.1, 3.0);
  expect("braking");
  EXPECT_LT(e.by_scale_B().x(), e.v_B().x() - 0.1) << "a faster vehicle also brakes harder";
  run(0.0, 5.0);
  expect("coasting");
}

TEST(PrimitiveEstimator, TurnsTheLastAttitudeOnOverTheLatency) {
  PrimitiveEstimator e = estimator();
  e.add(imu(0, Eigen::Quaterniond::Identity(), {0.0, 0.0, 0.5}));
  e.add(DepthSample{0, 3.0});
  EXPECT_NEAR(to_rpy(e.update(100'000).X_WB.q).z(), 0.05, 1e-12);
  EXPECT_NEAR(to_rpy(e.update(100'000'000).X_WB.q).z(), 0.25, 1e-9) << "not for ever";
}

TEST(PrimitiveEstimator, ContinuesWithAPredictedAttitudeAndAGrowingSigma) {
  PrimitiveEstimator e = estimator();
  Utime now = swim(e, 0, 0.0, 0.4, 10.0);
  const double before = horizontal_sigma(e.update(now));
  for (const Utime end = now + from_seconds(20.0); now < end;) {
    now += kTick;
    e.predict_attitude(now, from_rpy(0.0, 0.0, 1.0), Vector3d::Zero());
    e.add(DepthSample{now, 3.0});
    static_cast<void>(e.update(now));
  }
  EXPECT_NEAR(to_rpy(e.update(now).X_WB.q).z(), 1.0, 1e-9);
  EXPECT_GT(horizontal_sigma(e.update(now)), before + 0.25);
  EXPECT_GT(e.update(now).covariance(5, 5), 0.5);
  const double blind = horizontal_sigma(e.update(now));
  e.add(imu(now - kTick, Eigen::Quaterniond::Identity()));  // late, but the newest measurement
  EXPECT_NEAR(to_rpy(e.update(now).X_WB.q).z(), 0.0, 1e-9);
  EXPECT_LT(e.update(now).covariance(5, 5), 0.01);
  EXPECT_GE(horizontal_sigma(e.update(now)), 0.9 * blind) << "what was drifted stays unknown";
}

TEST(PrimitiveEstimator, TakesHeaveFromTheDepthWhenPitched) {
  PrimitiveEstimator e = estimator();
  const Eigen::Quaterniond q = from_rpy(0.0, deg_to_rad(40.0), 0.0);
  for (Utime now = kTick; now <= 5'000'000; now += kTick) {
    e.add(imu(now, q));
    e.add(DepthSample{now, 3.0 + 0.2 * to_seconds(now)});
    static_cast<void>(e.update(now));
  }
  // At rest, sinking at 0.2 m/s: the velocity in W is that of the depth, the rest unknown.
  EXPECT_NEAR((q * e.update(5'000'000).v_WB_B).z(), -0.2, 0.005);
  EXPECT_NEAR(e.update(5'000'000).v_WB_B.x(), 0.0, 0.03) << "surge is known better";
}

TEST(PrimitiveEstimator, IgnoresWhatIsNoMeasurement) {
  PrimitiveEstimator e = estimator();
  const Utime now = swim(e, 0, 0.3, 0.4, 5.0);
  const Pose before = e.update(now).X_WB;
  e.add(DepthSample{now + 1, std::nan("")});
  e.add(DepthSample{now - kTick, 900.0});
  e.add(imu(now + 1, Eigen::Quaterniond(0.0, 0.0, 0.0, 0.0)));
  e.add(imu(now + 1, Eigen::Quaterniond::Identity(), {0.0, std::nan(""), 0.0}));
  e.add(imu(now - kTick, from_rpy(0.0, 0.0, 3.0)));
  EXPECT_EQ(e.update(now).X_WB.p, before.p);
  EXPECT_EQ(e.update(now).X_WB.q.coeffs(), before.q.coeffs());
}

TEST(PrimitiveEstimator, DemandsTimeThatRunsAndOptionsThatHold) {
  PrimitiveEstimator e = estimator();
  static_cast<void>(e.update(100));
  EXPECT_THROW(static_cast<void>(e.update(99)), AssertionFailure);
  EXPECT_THROW(e.set_commanded_speed(std::nan("")), AssertionFailure);
  PrimitiveOptions options;
  options.depth_sigma_m = 0.0;
  EXPECT_THAT(options.validate(), ::testing::StartsWith("depth_sigma_m"));
  EXPECT_THROW(estimator(options), AssertionFailure);
  options = {};
  options.motion.sway_mass_ratio = std::numeric_limits<double>::infinity();
  EXPECT_THAT(options.validate(), ::testing::StartsWith("sway_mass_ratio"));
}

TEST(PrimitiveEstimator, AllocatesNothing) {
  PrimitiveEstimator e = estimator();
  testing::reset_allocations();
  swim(e, 0, 0.3, 0.4, 2.0);
  EXPECT_EQ(testing::allocations().count, 0U);
}

// The covariance that a Kalman filter with the states [p_xy, heading bias, speed scale] propagates,
// one step at a time.
struct Reference {
  Eigen::Matrix4d P;
  Vector2d last;

  Reference(const PrimitiveOptions& options, double sigma, const Vector2d& start)
      : P(Eigen::Vector4d(sigma * sigma, sigma * sigma,
                          std::pow(deg_to_rad(options.heading_bias_sigma_deg), 2),
                          options.speed_scale_sigma * options.speed_scale_sigma)
              .asDiagonal()),
        last(start) {}

  void propagate(const Vector2d& p, double drift, double dt) {
    const Vector2d step = p - last;
    last = p;
    Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
    F.block<2, 1>(0, 2) << step.y(), -step.x();
    F.block<2, 1>(0, 3) = step;
    P = F * P * F.transpose();
    P.topLeftCorner<2, 2>() += drift * drift * dt * Eigen::Matrix2d::Identity();
  }
};

RC_GTEST_PROP(Covariance, IsThatOfAKalmanFilterSymmetricAndPositive, ()) {
  const PrimitiveOptions options;
  PrimitiveEstimator e = estimator(options);
  Reference reference(options, 0.05, {1.0, 2.0});
  Utime now = kTick;
  e.add(imu(now, Eigen::Quaterniond::Identity()));
  e.add(DepthSample{now, 3.0});
  static_cast<void>(e.update(now));
  for (int leg = 0; leg < 4; ++leg) {
    const Vector3d rpy = *testing::arbitrary_vector(1.2);
    e.set_commanded_speed(*testing::arbitrary_double(-0.2, 0.8));
    for (int i = 0; i < 200; ++i) {
      now += kTick;
      e.add(imu(now, from_rpy(rpy.x(), rpy.y(), 2.5 * rpy.z())));
      e.add(DepthSample{now, 3.0});
      reference.propagate(e.update(now).X_WB.p.head<2>(), options.drift_m_per_sqrt_s, 0.02);
    }
    const Matrix6d& P = e.update(now).covariance;
    RC_ASSERT((P - P.transpose()).norm() == 0.0);
    RC_ASSERT(Eigen::SelfAdjointEigenSolver<Matrix6d>(P).eigenvalues().minCoeff() > 0.0);
    RC_ASSERT((P.topLeftCorner<2, 2>() - reference.P.topLeftCorner<2, 2>()).norm() <
              1e-6 * reference.P.norm());
    // A heading error of +b turns the true heading by -b about W's z axis, expressed in B.
    const Vector3d z_B = e.update(now).X_WB.q.conjugate() * Vector3d::UnitZ();
    const Eigen::Matrix<double, 2, 3> cross = -reference.P.block<2, 1>(0, 2) * z_B.transpose();
    RC_ASSERT((P.block<2, 3>(0, 3) - cross).norm() < 1e-6 * reference.P.norm());
  }
}

TEST(Covariance, GrowsOutwardsAndShrinksOnTheReturn) {
  PrimitiveOptions options;
  options.drift_m_per_sqrt_s = 0.0;
  PrimitiveEstimator e = estimator(options);
  const auto area = [&e](Utime now) {
    return e.update(now).covariance.topLeftCorner<2, 2>().determinant();
  };
  Utime now = swim(e, 0, 0.4, 0.4, 5.0);
  const double near = area(now);
  now = swim(e, now, 0.4, 0.4, 40.0);
  const double far = area(now);
  now = swim(e, now, 0.4 + M_PI, 0.4, 40.0);
  EXPECT_GT(far, 5.0 * near);
  EXPECT_LT(area(now), 1.2 * near);
}

TEST(DepthFilter, SettlesOnASteadyRateWithTheVarianceItClaims) {
  DepthFilter filter(0.02, 0.05, 0.0);
  for (int i = 0; i <= 500; ++i) filter.add(i * kTick, -3.0 - 0.1 * 0.02 * i);
  const DepthFilter::Height height = filter.at(500 * kTick + 100'000);
  EXPECT_NEAR(height.z, -3.0 - 0.1 * 10.1, 1e-3) << "extrapolated";
  EXPECT_NEAR(height.rate, -0.1, 1e-3);
  EXPECT_LT(height.variance, 0.02 * 0.02);
  EXPECT_GT(filter.at(502 * kTick).variance, filter.at(500 * kTick).variance);
}

}  // namespace
}  // namespace dive::estimation
