#include "estimation/dataset/trajectory.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/random.h"
#include "estimation/dataset/trajectory_error.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

// More than twenty metres, in all directions.
Trajectory spiral(int poses = 400) {
  Trajectory trajectory;
  for (int i = 0; i < poses; ++i) {
    const double t = 0.05 * i;
    trajectory.push_back({from_seconds(t),
                          {{3.0 * std::cos(0.5 * t), 2.0 * std::sin(0.5 * t), -0.1 * t},
                           from_rpy(0.1 * std::sin(t), 0.2 * std::cos(t), 0.5 * t)}});
  }
  return trajectory;
}

Trajectory moved(const Trajectory& trajectory, const Pose& X) {
  Trajectory result;
  for (const StampedPose& at : trajectory) result.push_back({at.utime, X * at.X_WB});
  return result;
}

StampedPose at_x(Utime utime, double x) {
  return {utime, {{x, 0.0, 0.0}, Eigen::Quaterniond::Identity()}};
}

Pose random_pose(Random& random, bool upright) {
  const double roll = upright ? 0.0 : random.uniform(-3, 3);
  const double pitch = upright ? 0.0 : random.uniform(-1.5, 1.5);
  return {{random.normal(), random.normal(), random.normal()},
          from_rpy(roll, pitch, random.uniform(-3, 3))};
}

TEST(Tum, ReadsWhatItWrites) {
  Trajectory trajectory = spiral(20);
  for (StampedPose& at : trajectory) at.utime += 1403636579763556;
  const auto read = from_tum(to_tum(trajectory), "a.tum");
  ASSERT_TRUE(read) << read.error();
  ASSERT_EQ(read->size(), trajectory.size());
  for (std::size_t i = 0; i < read->size(); ++i) {
    EXPECT_LE(std::abs((*read)[i].utime - trajectory[i].utime), 1);
    EXPECT_LT(((*read)[i].X_WB.p - trajectory[i].X_WB.p).norm(), 1e-8);
    EXPECT_LT(angle_between((*read)[i].X_WB.q, trajectory[i].X_WB.q), 1e-7);
  }
}

TEST(Tum, HasScalarLast) {
  const std::string text = to_tum({{1'500'000, {{1, 2, 3}, from_rpy(0, 0, M_PI / 2)}}});
  EXPECT_THAT(text, HasSubstr("1.500000 1.000000000 2.000000000 3.000000000 0.000000000 "
                              "0.000000000 0.707106781 0.707106781\n"));
}

TEST(Tum, ReportsWhereAndWhatIsWrong) {
  const auto error = [](const std::string& text) {
    const auto read = from_tum(text, "a.tum");
    return read ? "it is read" : read.error();
  };
  EXPECT_THAT(error("# x\n1 2 3\n"), HasSubstr("a.tum:2: 3 numbers"));
  EXPECT_THAT(error("1 2 3 4 0 0 0 one\n"), HasSubstr("\"one\""));
  EXPECT_THAT(error("1 2 3 4 0 0 0 0\n"), HasSubstr("length 1"));
  EXPECT_THAT(error("-1 2 3 4 0 0 0 1\n"), HasSubstr("its time"));
  EXPECT_THAT(error("1 2 3 4 0 0 0 1\n1 2 3 4 0 0 0 1\n"), HasSubstr("a.tum:2: its time"));
}

RC_GTEST_PROP(Ate, IsNothingForTheSamePathElsewhere, ()) {
  Random random(*rc::gen::arbitrary<std::uint64_t>());
  const Trajectory truth = spiral();
  for (const bool upright : {true, false}) {
    const auto pairs = pair_up(moved(truth, random_pose(random, upright)), truth);
    RC_ASSERT(pairs.size() == truth.size());
    const auto X = align(pairs, upright ? Alignment::kYawAndTranslation : Alignment::kRigid);
    RC_ASSERT(X.has_value());
    const AbsoluteError error = absolute_error(pairs, *X);
    RC_ASSERT(error.rmse_m < 1e-9);
    RC_ASSERT(error.rmse_deg < 1e-5);
  }
}

// Errors of 0.3 m, whose directions cancel out: no alignment removes them.
TEST(Ate, IsTheRootMeanSquareOfWhatIsLeft) {
  const Trajectory truth = spiral();
  Trajectory estimate = moved(truth, {{5, -3, 2}, from_rpy(0, 0, 1.0)});
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].X_WB.p.z() += i % 2 == 0 ? 0.3 : -0.3;
  }
  const auto pairs = pair_up(estimate, truth);
  const auto X = align(pairs, Alignment::kYawAndTranslation);
  ASSERT_TRUE(X);
  EXPECT_NEAR(absolute_error(pairs, *X).rmse_m, 0.3, 1e-3);
  EXPECT_NEAR(absolute_error(pairs, *X).max_m, 0.3, 2e-3);
}

// A tilt is an error for an estimator with gravity, and none for one without.
TEST(Ate, YawAlignmentLeavesATilt) {
  const Trajectory truth = spiral();
  const auto pairs = pair_up(moved(truth, {{0, 0, 0}, from_rpy(0.1, 0, 0)}), truth);
  EXPECT_GT(absolute_error(pairs, *align(pairs, Alignment::kYawAndTranslation)).rmse_m, 0.1);
  EXPECT_LT(absolute_error(pairs, *align(pairs, Alignment::kRigid)).rmse_m, 1e-9);
}

TEST(Ate, NeverScales) {
  const Trajectory truth = spiral();
  Trajectory estimate = truth;
  for (StampedPose& at : estimate) at.X_WB.p *= 1.1;
  const auto pairs = pair_up(estimate, truth);
  EXPECT_GT(absolute_error(pairs, *align(pairs, Alignment::kRigid)).rmse_m, 0.2);
}

TEST(Ate, RefusesWhatDeterminesNoAlignment) {
  EXPECT_FALSE(align({}, Alignment::kYawAndTranslation));
  std::vector<PosePair> pairs(5);
  EXPECT_FALSE(align(pairs, Alignment::kYawAndTranslation));
  EXPECT_FALSE(align(pairs, Alignment::kRigid));
  for (std::size_t i = 0; i < pairs.size(); ++i) {  // on a line
    pairs[i].estimate.p.x() = pairs[i].truth.p.x() = static_cast<double>(i);
  }
  EXPECT_TRUE(align(pairs, Alignment::kYawAndTranslation));
  EXPECT_FALSE(align(pairs, Alignment::kRigid));
}

TEST(Rpe, ReportsAScaleAsItsPercentage) {
  Trajectory truth;
  for (int i = 0; i <= 1000; ++i) truth.push_back(at_x(i * 50'000, 0.02 * i));
  Trajectory estimate = truth;
  for (StampedPose& at : estimate) at.X_WB.p *= 1.02;
  const auto pairs = pair_up(moved(estimate, {{7, 8, 9}, from_rpy(0, 0, 2)}), truth);
  const RelativeError five = relative_error(pairs, 5.0);
  EXPECT_GT(five.stretches, 700);
  EXPECT_NEAR(five.percent, 2.0, 0.02);
  EXPECT_NEAR(five.mean_m, 0.1, 1e-3);
  EXPECT_NEAR(five.mean_deg, 0.0, 1e-6);
  EXPECT_NEAR(drift_percent(pairs), 2.0, 1e-6);
  EXPECT_EQ(relative_error(pairs, 50.0).stretches, 0);
}

TEST(Pairs, AreInterpolatedAndNotAcrossGaps) {
  Trajectory truth{at_x(0, 0.0), at_x(100'000, 1.0), at_x(900'000, 2.0)};
  Trajectory estimate = truth;
  estimate[0].utime = 25'000;
  estimate[1].utime = 500'000;
  estimate[2].utime = 900'001;
  const auto pairs = pair_up(estimate, truth);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_NEAR(pairs[0].truth.p.x(), 0.25, 1e-12);
}

// Errors drawn from the stated covariance: 3 in the mean; with half the stated sigma: 12.
TEST(Nees, IsThreeForAConsistentCovariance) {
  Random random(11);
  const Trajectory truth = spiral(4000);
  std::vector<StateEstimate> estimates;
  for (const StampedPose& at : truth) {
    StateEstimate e;
    e.utime = at.utime;
    e.valid = true;
    const Vector3d dp(0.2 * random.normal(), 0.1 * random.normal(), 0.05 * random.normal());
    const Vector3d dq(0.01 * random.normal(), 0.02 * random.normal(), 0.04 * random.normal());
    e.X_WB = {at.X_WB.p - dp, at.X_WB.q * so3_exp(-dq)};
    e.covariance.diagonal() << 0.04, 0.01, 0.0025, 1e-4, 4e-4, 16e-4;
    estimates.push_back(e);
  }
  const Nees honest = nees(estimates, truth);
  EXPECT_EQ(honest.samples, 4000);
  EXPECT_NEAR(honest.position, 3.0, 0.15);
  EXPECT_NEAR(honest.orientation, 3.0, 0.15);
  for (StateEstimate& e : estimates) e.covariance *= 0.25;
  EXPECT_NEAR(nees(estimates, truth).position, 12.0, 0.6);
  estimates[0].covariance.setZero();  // undefined, and not counted
  EXPECT_EQ(nees(estimates, truth).samples, 3999);
}

TEST(ClosureErrors, AreSeenFromTheEarlierPose) {
  const Eigen::Quaterniond left = from_rpy(0, 0, M_PI / 2);
  const Trajectory truth = {{0, {{0, 0, 0}, left}}, {100'000, {{0, 2, 0}, left}}};
  LoopClosure right;
  right.utime_new = 100'000;
  right.X_B0B1.p = {2, 0, 0};
  LoopClosure wrong = right;
  wrong.X_B0B1.p = {2, 0.5, 0};
  LoopClosure unknown = right;
  unknown.utime_new = 900'000;
  const std::vector<double> errors = closure_errors({right, wrong, unknown}, truth);
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_NEAR(errors[0], 0.0, 1e-12);
  EXPECT_NEAR(errors[1], 0.5, 1e-12);
}

}  // namespace
}  // namespace dive::estimation
