// The IMU's step against numerical derivatives and motion in closed form; the buffer's gaps and
// rejections.

#include "estimation/visual_inertial/filter/imu_propagation.h"

#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "estimation/visual_inertial/filter/imu_buffer.h"
#include "test/common/arbitrary.h"
#include "test/estimation/visual_inertial/filter/analytic_dive.h"
#include "test/estimation/visual_inertial/filter/numeric_jacobian.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::numeric_jacobian;
using testing::turn_by;
using testing::turned;

ImuState arbitrary_state() {
  ImuState state;
  const Pose pose = *testing::arbitrary_pose();
  state.motion = {pose.q, pose.p, *testing::arbitrary_vector(2.0)};
  state.gyro_bias = *testing::arbitrary_vector(0.1);
  state.accel_bias = *testing::arbitrary_vector(0.5);
  for (double& x : state.intrinsics.gyro.reshaped()) x = *testing::arbitrary_double(-0.02, 0.02);
  for (double& x : state.intrinsics.accel.reshaped()) x = *testing::arbitrary_double(-0.02, 0.02);
  return state;
}

ImuInterval arbitrary_interval() {
  ImuInterval interval;
  interval.begin = {*testing::arbitrary_vector(2.0), *testing::arbitrary_vector(15.0)};
  interval.end = {*testing::arbitrary_vector(2.0), *testing::arbitrary_vector(15.0)};
  interval.dt = *testing::arbitrary_double(0.001, 0.05);
  return interval;
}

ImuState disturbed(const ImuState& state, const VectorXd& e) {
  ImuState result = state;
  result.motion.q_WB = turn_by(state.motion.q_WB, e.segment<3>(0));
  result.motion.p_WB += e.segment<3>(3);
  result.motion.v_WB += e.segment<3>(6);
  result.gyro_bias += e.segment<3>(9);
  result.accel_bias += e.segment<3>(12);
  if (e.size() == 15) return result;
  result.intrinsics.gyro.reshaped() += e.segment<9>(15);
  result.intrinsics.accel.reshaped() += e.segment<9>(24);
  return result;
}

VectorXd difference(const ImuState& from, const ImuState& to) {
  VectorXd e(15);
  e << turned(from.motion.q_WB, to.motion.q_WB), to.motion.p_WB - from.motion.p_WB,
      to.motion.v_WB - from.motion.v_WB, to.gyro_bias - from.gyro_bias,
      to.accel_bias - from.accel_bias;
  return e;
}

RC_GTEST_PROP(Propagation, HasTheTransitionThatDifferencesGive, ()) {
  const ImuState state = arbitrary_state();
  const ImuInterval interval = arbitrary_interval();
  const ImuStep step = propagate(state, interval, {}, 9.81);
  const auto numeric = numeric_jacobian(
      [&](const VectorXd& e) {
        const ImuState other = disturbed(state, e);
        return difference(step.state, propagate(other, interval, {}, 9.81).state);
      },
      33);
  RC_ASSERT((step.transition - numeric.leftCols<15>()).cwiseAbs().maxCoeff() < 1e-6);
  RC_ASSERT((step.by_intrinsics - numeric.topRightCorner<9, 18>()).cwiseAbs().maxCoeff() < 1e-6);
  RC_ASSERT((step.noise - step.noise.transpose()).norm() < 1e-15);
  RC_ASSERT(Eigen::SelfAdjointEigenSolver<Matrix15d>(step.noise).eigenvalues().minCoeff() > -1e-18);
}

// Propagation preserves a rotation of everything about the vertical and a translation.
RC_GTEST_PROP(Propagation, CarriesTurnsAboutTheVerticalAndShiftsOn, ()) {
  const ImuState state = arbitrary_state();
  const ImuStep step = propagate(state, arbitrary_interval(), {}, 9.81);
  const auto turn = [](const Kinematics& at) {
    VectorXd n = VectorXd::Zero(15);
    n.segment<3>(0) = at.q_WB.conjugate() * Vector3d::UnitZ();
    n.segment<3>(3) = Vector3d::UnitZ().cross(at.p_WB);
    n.segment<3>(6) = Vector3d::UnitZ().cross(at.v_WB);
    return n;
  };
  const VectorXd error = step.transition * turn(state.motion) - turn(step.state.motion);
  RC_ASSERT(error.norm() < 1e-10);
}

TEST(Propagation, FollowsAMotionInClosedForm) {
  for (const double hz : {200.0, 50.0}) {
    testing::AnalyticDiveOptions options;
    options.imu_hz = hz;
    options.gyro_noise = options.accel_noise = options.gyro_walk = options.accel_walk = 0.0;
    options.imu_scale_sigma = options.gyro_by_accel_sigma = 0.0;
    testing::AnalyticDive dive(options, 3);
    VisualInertialOptions filter;
    ImuBuffer buffer(filter);
    const auto tick = static_cast<Utime>(1e6 / hz);
    for (Utime utime = 0; utime <= 10'000'000; utime += tick) {
      ASSERT_EQ(buffer.add(dive.imu(utime)), ImuCheck::kGood);
    }
    const testing::DiveTruth begin = dive.truth(0.0123);
    ImuState state{{begin.X_WB.q, begin.X_WB.p, begin.X_WB.q * begin.v_WB_B},
                   dive.gyro_bias(),
                   dive.accel_bias()};
    std::vector<ImuInterval> intervals;
    buffer.intervals(12'300, 9'998'100, intervals);
    for (const ImuInterval& interval : intervals) {
      state = propagate(state, interval, {}, 9.81).state;
    }
    const testing::DiveTruth end = dive.truth(9.9981);
    EXPECT_LT((state.motion.p_WB - end.X_WB.p).norm(), hz > 100.0 ? 0.001 : 0.02) << hz;
    EXPECT_LT(turned(state.motion.q_WB, end.X_WB.q).norm(), 1e-4) << hz;
  }
}

ImuSample sample(Utime utime, const Vector3d& gyro = Vector3d::Zero()) {
  ImuSample result;
  result.utime = utime;
  result.gyro_B = gyro;
  result.accel_B = {0.0, 0.0, 9.81};
  return result;
}

TEST(ImuBuffer, ReportsWhatIsWrongWithASample) {
  VisualInertialOptions options;
  ImuBuffer buffer(options);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(buffer.add(sample(0)), ImuCheck::kGood);
  EXPECT_EQ(buffer.add(sample(0)), ImuCheck::kStamp) << "twice";
  EXPECT_EQ(buffer.add(sample(-5'000)), ImuCheck::kStamp) << "reversed";
  EXPECT_EQ(buffer.add(sample(5'000, {nan, 0, 0})), ImuCheck::kNotFinite);
  EXPECT_EQ(buffer.add(sample(10'000, {9.0, 0, 0})), ImuCheck::kSaturated);
  EXPECT_EQ(buffer.newest().gyro_B.x(), options.gyro_limit);
  EXPECT_EQ(buffer.add(sample(100'000)), ImuCheck::kGap);
  EXPECT_EQ(buffer.add(sample(3'600'000'000)), ImuCheck::kStamp) << "one leap is an error";
  EXPECT_EQ(buffer.add(sample(105'000)), ImuCheck::kGood);
  EXPECT_EQ(buffer.add(sample(3'600'000'000)), ImuCheck::kStamp);
  EXPECT_EQ(buffer.add(sample(3'600'005'000)), ImuCheck::kGap) << "two are the time";
}

TEST(ImuBuffer, CoversEveryMicrosecondAndAddsUncertaintyInGaps) {
  VisualInertialOptions options;
  ImuBuffer buffer(options);
  for (const Utime utime : {0, 5'000, 10'000, 310'000, 315'000}) buffer.add(sample(utime));
  std::vector<ImuInterval> intervals;
  buffer.intervals(-2'000, 320'000, intervals);
  double covered = 0.0;
  double suspected = 0.0;
  for (const ImuInterval& interval : intervals) {
    EXPECT_GT(interval.dt, 0.0);
    EXPECT_LE(interval.dt, 0.05 + 1e-9);
    covered += interval.dt;
    if (interval.gyro > 0.0) suspected += interval.dt;
  }
  EXPECT_NEAR(covered, 0.322, 1e-9);
  EXPECT_NEAR(suspected, 0.3, 1e-9);
}

}  // namespace
}  // namespace dive::estimation
