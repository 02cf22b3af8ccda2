// A retrace in an unknown environment observes a blocked trail before it plans, and aims its
// detours.

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "test/behaviors/retrace_sample.h"

namespace dive::behaviors {
namespace {

// What blocks the trail may go away, and nothing but the trail is known.
class RetraceInUnknownEnvironment : public RetraceTest {
 protected:
  RetraceInUnknownEnvironment() { settings_.recovery.blocked_trail.wait_s = 90.0; }
};

TEST_F(RetraceInUnknownEnvironment, ObservesTheTrailThreeTimesBeforeItPlans) {
  trail_ = Trail();
  swim_in({-4, 0, -4}, {8, 0, -4});
  swim_in({8, 0, -4}, {8, 0.5, -4});
  block(4.1, 4.9);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  const Utime blocked_since = now_;
  while (!output.plan_request && to_seconds(now_ - blocked_since) < 60.0) {
    EXPECT_EQ(output.failed, Failure::kNone);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.0);
    if (to_seconds(now_ - blocked_since) < 17.9) {
      EXPECT_NEAR(yaw_of(output.command.o), std::atan2(-0.5, -1.0), 1e-9)
          << "to the first breadcrumb that is a metre away";
    }
    output = tick(retrace);
  }
  EXPECT_NEAR(to_seconds(now_ - blocked_since), 18.0, 0.05);
}

TEST_F(RetraceInUnknownEnvironment, KeepsItsPlaceEachTimeItObservesTheTrail) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  EXPECT_EQ(tick(retrace).command.d, 4.0);
  p_W().z() = -4.1;
  EXPECT_EQ(tick(retrace).command.d, 4.0);
  static_cast<void>(after(6.0, retrace));
  EXPECT_EQ(tick(retrace).command.d, 4.1);
}

TEST_F(RetraceInUnknownEnvironment, ContinuesWhenTheTrailIsFreeAgain) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  EXPECT_EQ(tick(retrace).command.v, 0.0);
  clearance_is(2.0);
  EXPECT_EQ(after(5.98, retrace).command.v, 0.0);
  EXPECT_EQ(tick(retrace).command.v, 0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0);
  EXPECT_FALSE(retrace.needs_free_ahead());
  EXPECT_GT(after(60.0 + 4.0 * 11.5 / 0.5 - kTick, retrace).command.v, 0.0);
  EXPECT_TRUE(tick(retrace).plan_request) << "the time on the trail counts from there";
}

TEST_F(RetraceInUnknownEnvironment, ObservesATrailWithLessThan40PercentOfTheClearance) {
  clearance_is(0.241);
  Retrace enough = with_map();
  EXPECT_GT(tick(enough).command.v, 0.0);
  EXPECT_GT(observe(enough).command.v, 0.0);
  clearance_is(0.239);
  EXPECT_EQ(observe(enough).command.v, 0.0);

  Retrace little = with_map();
  BehaviorOutput output = tick(little);
  const Utime blocked_since = now_;
  while (output.command.v == 0.0 && to_seconds(now_ - blocked_since) < 60.0) output = tick(little);
  EXPECT_NEAR(to_seconds(now_ - blocked_since), 18.0, 0.05) << "then it is swum";
  EXPECT_GT(observe(little).command.v, 0.0);
  EXPECT_FALSE(little.needs_free_ahead());
}

TEST_F(RetraceInUnknownEnvironment, APlannedPathMayHaveLittleClearance) {
  Retrace retrace = with_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  ASSERT_TRUE(after(1000.0, retrace).plan_request) << "it does not get on";
  clearance_is(0.0);
  EXPECT_FALSE(observe(retrace).plan_request);
  EXPECT_GT(follow_path(retrace, {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)}).command.v, 0.0);
  clearance_is(0.001);
  EXPECT_GT(observe(retrace).command.v, 0.0);
  clearance_is(0.0);
  const BehaviorOutput output = observe(retrace);
  EXPECT_FALSE(output.plan_request) << "it observes first";
  EXPECT_EQ(output.command.v, 0.0);
}

TEST_F(RetraceInUnknownEnvironment, ObservesAndPlansAgainUntilItsTimeIsOver) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  const Utime blocked_since = now_;
  std::vector<double> clearances;
  std::vector<double> times;
  while (output.failed == Failure::kNone && to_seconds(now_) < 200.0) {
    if (output.plan_request) {
      clearances.push_back(output.plan_request->limits.clearance);
      times.push_back(to_seconds(now_));
    }
    output = tick(retrace, output.plan_request ? &no_path_ : nullptr);
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_NEAR(to_seconds(now_ - blocked_since), 90.0, 0.15);
  EXPECT_EQ(tick(retrace).failed, Failure::kExhausted);
  ASSERT_GT(clearances.size(), 8U);
  for (std::size_t i = 4; i < clearances.size(); ++i) {
    EXPECT_EQ(clearances[i], clearances[i - 4]);
    EXPECT_NEAR(times[i] - times[i - 4], 6.0, 0.15) << "it observes between";
  }
  EXPECT_NEAR(clearances[0], 0.6, 1e-12);
  EXPECT_NEAR(clearances[3], 0.06, 1e-12);
}

TEST_F(RetraceInUnknownEnvironment, ItsTimeBeginsAgainHalfAMetreAlongAPlannedPath) {
  block(4.1, 4.9);
  for (const double swum : {0.49, 0.51}) {
    p_W() = {8, 0, -4};
    Retrace retrace = with_map();
    static_cast<void>(tick(retrace));
    const Utime blocked_since = now_;
    ASSERT_TRUE(wait_for_request(retrace).plan_request);
    EXPECT_GT(follow_path(retrace, {pose_at(8, 0), pose_at(8, 3), pose_at(2, 3)}).command.v, 0.0);
    p_W().y() = swum;
    now_ = blocked_since + from_seconds(60.0);
    const double left_s = fail(retrace, observe(retrace));
    EXPECT_NEAR(left_s, swum < 0.5 ? 30.0 : 90.0, 0.2) << swum;
  }
}

TEST_F(RetraceInUnknownEnvironment, ItsTimeBeginsAgainTwoMetresAlongTheTrail) {
  for (const double swum : {1.9, 2.1}) {
    p_W() = {8, 0, -4};
    block(4.1, 4.9);
    Retrace retrace = with_map();
    EXPECT_EQ(tick(retrace).command.v, 0.0);
    const Utime blocked_since = now_;
    clearance_is(2.0);
    static_cast<void>(after(6.0, retrace));
    EXPECT_GT(tick(retrace).command.v, 0.0);
    p_W().x() -= swum;
    now_ = blocked_since + from_seconds(40.0);
    block(4.1, 4.9);
    BehaviorOutput output = observe(retrace);
    const Utime again = now_;
    output = wait_for_request(retrace);
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(to_seconds(now_ - again), swum < 2.0 ? 12.0 : 18.0, 0.05) << "it observes";
    const double left_s = to_seconds(now_ - again) + fail(retrace, output);
    EXPECT_NEAR(left_s, swum < 2.0 ? 50.0 : 90.0, 0.2) << swum;
  }
}

TEST_F(RetraceInUnknownEnvironment, IgnoresTheAnswerToACancelledRequest) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(wait_for_request(retrace).plan_request);
  EXPECT_FALSE(wait_for_request(retrace, 11.0).plan_request) << "it observes again";
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  EXPECT_EQ(follow_path(retrace, north).command.v, 0.0);
  EXPECT_FALSE(retrace.needs_free_ahead());
  clearance_is(2.0);
  BehaviorOutput output = after(6.0, retrace);
  output = tick(retrace);
  EXPECT_GT(output.command.v, 0.0);
  output = follow_path(retrace, north);
  EXPECT_FALSE(retrace.needs_free_ahead());
  EXPECT_NEAR(std::abs(yaw_of(output.command.o)), M_PI, 0.01) << "along the trail";
  EXPECT_EQ(retrace.progress().clearance_m, 0.0);
}

// The goal of the path that is planned: off the trail as little as can be, and hardly higher.
class RetraceAim : public RetraceInUnknownEnvironment {
 protected:
  planning::PlanRequest request_from(double x) {
    p_W() = {x, 0, -4};
    Retrace retrace = with_map();
    const BehaviorOutput output = wait_for_request(retrace);
    EXPECT_TRUE(output.plan_request);
    return output.plan_request.value_or(planning::PlanRequest());
  }
};

TEST_F(RetraceAim, IsBehindWhatBlocksTheTrail) {
  block(4.1, 4.9);
  EXPECT_EQ(request_from(8.0).goal.p, Eigen::Vector3d(3.5, 0, -4));
  block(7.1, 7.4);
  EXPECT_EQ(request_from(8.0).goal.p, Eigen::Vector3d(6.5, 0, -4)) << "however near";
  block(-2.0, 4.9);
  EXPECT_EQ(request_from(8.0).goal.p, Eigen::Vector3d(-1.5, 0, -4)) << "or at its end";
  evaluator_.at = [](const Eigen::Vector3d& p_W) {
    const bool is_near = p_W.x() > 6.1 && p_W.x() < 6.9;
    const bool is_far = p_W.x() > 2.1 && p_W.x() < 2.9;
    return is_near || is_far ? 0.0 : 0.001;
  };
  EXPECT_EQ(request_from(8.0).goal.p, Eigen::Vector3d(1.5, 0, -4)) << "behind the last";
}

TEST_F(RetraceAim, IsThreeMetresOnWhereNothingBlocksTheTrail) {
  p_W() = {8, 0, -4};
  Retrace retrace = with_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  const BehaviorOutput output = after(1000.0, retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_EQ(output.plan_request->goal.p, Eigen::Vector3d(5, 0, -4));
}

TEST_F(RetraceAim, IsWithinFifteenMetresOfTheTrail) {
  trail_ = Trail();
  swim_in({-4, 0, -4}, {30, 0, -4});
  evaluator_.at = [](const Eigen::Vector3d& p_W) {
    const bool is_near = p_W.x() > 26.1 && p_W.x() < 26.9;
    const bool is_far = p_W.x() > 14.1 && p_W.x() < 14.4;
    return is_near || is_far ? 0.0 : 0.001;
  };
  EXPECT_EQ(request_from(30.0).goal.p, Eigen::Vector3d(25.5, 0, -4));
  EXPECT_EQ(request_from(29.0).goal.p, Eigen::Vector3d(13.5, 0, -4));
}

TEST_F(RetraceAim, IsAtMost30CentimetresAboveTheTrail) {
  trail_ = Trail();
  swim_in({-4, 0, -4}, {1.5, 0, -4});
  trail_.add({2, 0, -2}, false);
  swim_in({2.5, 0, -4}, {5.5, 0, -4});
  trail_.add({6, 0, -3}, false);
  swim_in({6.5, 0, -4}, {10, 0, -4});
  block(4.1, 4.9);
  EXPECT_NEAR(request_from(10.0).limits.max_z, -2.7, 1e-12) << "higher only behind the goal";
  settings_.limits.max_z = -3.2;
  EXPECT_EQ(request_from(10.0).limits.max_z, -3.2) << "the mission's limit stays";
}

TEST_F(RetraceAim, IsOpenWaterInAKnownEnvironment) {
  settings_.recovery.blocked_trail.wait_s = 0.0;
  block(4.1, 4.9);
  const planning::PlanRequest request = request_from(8.0);
  EXPECT_EQ(request.goal.p, Eigen::Vector3d(-1.5, 0, -4));
  EXPECT_EQ(request.limits.max_z, -0.5);
}

TEST_F(RetraceAim, IsOpenWaterWithoutAMap) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  const BehaviorOutput output = after(1000.0, retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_EQ(output.plan_request->goal.p, Eigen::Vector3d(-1.5, 0, -4));
  EXPECT_EQ(output.plan_request->limits.max_z, -0.5);
}

}  // namespace
}  // namespace dive::behaviors
