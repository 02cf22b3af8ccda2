// What a retrace does when its trail is blocked: detours, with less and less clearance.

#include <algorithm>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "test/behaviors/retrace_sample.h"

namespace dive::behaviors {
namespace {

TEST_F(RetraceTest, PlansAroundABlockedTrailWithLessAndLessClearance) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  EXPECT_NEAR(retrace.progress().distance_to_go_m, 11.5, 1e-9) << "by the trail";
  std::set<std::uint64_t> seeds;
  for (const double clearance : {0.6, 0.36, 0.18, 0.06}) {
    ASSERT_TRUE(output.plan_request);
    EXPECT_STREQ(output.plan_cause, "the trail is blocked");
    const planning::PlanRequest& request = *output.plan_request;
    EXPECT_NEAR(request.limits.clearance, clearance, 1e-12);
    EXPECT_EQ(request.start.p, p_W());
    EXPECT_EQ(request.goal.p, Eigen::Vector3d(-1.5, 0, -4)) << "where the trail leads out";
    EXPECT_FALSE(request.goal_attitude_fixed);
    EXPECT_EQ(request.limits.min_altitude, 0.0);
    EXPECT_EQ(request.limits.min_z, -20.0);
    EXPECT_EQ(request.limits.max_z, -0.5);
    seeds.insert(request.seed);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.0);
    EXPECT_FALSE(tick(retrace).plan_request) << "one at a time";
    p_W().z() = -4.1;
    output = observe(retrace);
    EXPECT_FALSE(output.plan_request) << "whatever the map shows meanwhile";
    EXPECT_EQ(output.command.d, 4.0) << "it keeps its place";
    p_W().z() = -4.0;
    output = tick(retrace, &no_path_);
  }
  EXPECT_TRUE(seeds.contains(7));
  EXPECT_EQ(seeds.size(), 4U) << "another try must be able to end otherwise";
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_FALSE(output.plan_request);
  EXPECT_EQ(retrace.progress().plan_failures, 4);
  EXPECT_EQ(retrace.progress().plan_failure, "too tight");
}

TEST_F(RetraceTest, APlannerThatDoesNotAnswerInTenSecondsHasFailed) {
  block(4.1, 4.9);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  int failures = 0;
  for (const double clearance : {0.6, 0.36, 0.18, 0.06}) {
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(output.plan_request->limits.clearance, clearance, 1e-12);
    output = after(10.0, retrace);
    EXPECT_FALSE(output.plan_request || output.failed != Failure::kNone);
    output = tick(retrace);
    EXPECT_EQ(retrace.progress().plan_failures, ++failures);
    EXPECT_EQ(retrace.progress().plan_failure, "the planner did not answer within 10 s");
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
}

// By the map the vehicle is inside something, which it is not: the map's error, or its position's.
TEST_F(RetraceTest, InsideAnObstacleByTheMapItTrustsItsTrail) {
  clearance_is(-0.05);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  while (output.plan_request) output = tick(retrace, &no_path_);
  double fastest = 0.0;
  while (!output.done && output.failed == Failure::kNone && to_seconds(now_) < 200.0) {
    EXPECT_FALSE(output.plan_request);
    fastest = std::max(fastest, output.command.v);
    obey(output.command);
    can_go_up_ = p_W().x() < 0.0;
    output = observe(retrace);
  }
  EXPECT_TRUE(output.done);
  EXPECT_EQ(fastest, 0.25) << "slowly";
  EXPECT_LT(p_W().x(), -1.0);
}

TEST_F(RetraceTest, WhatAScanShowsOnATrustedTrailStopsIt) {
  clearance_is(-0.05);
  Retrace retrace = with_map();
  BehaviorOutput output = tick(retrace);
  const Utime began = now_;
  int trusted = 0;
  while (output.failed == Failure::kNone && to_seconds(now_ - began) < 200.0) {
    if (output.plan_request) {
      output = tick(retrace, &no_path_);
    } else if (retrace.progress().trusts_trail && output.command.v > 0.0) {
      ++trusted;
      now_ += from_seconds(kTick);
      BehaviorInput stopped = input();
      stopped.obstacle_ahead = true;
      output = retrace.step(stopped);
      EXPECT_EQ(output.command.v, 0.0);
    } else {
      output = observe(retrace);
    }
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_NEAR(to_seconds(now_ - began), 30.0, 7.0);
  EXPECT_EQ(trusted, 5) << "and it tries again every 6 s";
}

TEST_F(RetraceTest, EvaluatesTheTrailWhenTheMapHasChanged) {
  Retrace retrace = without_map();
  clearance_is(0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0) << "no map to evaluate it";
  BehaviorInput unchanged = input();
  unchanged.observed = &evaluator_;
  EXPECT_GT(retrace.step(unchanged).command.v, 0.0);
  BehaviorInput without_map = input();
  without_map.map_changed = true;
  EXPECT_GT(retrace.step(without_map).command.v, 0.0);
  clearance_is(0.001);
  EXPECT_GT(observe(retrace).command.v, 0.0) << "little clearance will do";
  p_W() = {9.7, 0, -4.3};
  EXPECT_GT(tick(retrace).command.v, 0.0);
  clearance_is(0.0);
  const BehaviorOutput output = observe(retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_STREQ(output.plan_cause, "the trail is blocked");
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_EQ(output.command.d, 4.3) << "where it is";
  EXPECT_EQ(output.plan_request->start.p, p_W());
}

TEST_F(RetraceTest, EvaluatesFifteenMetresOfTheTrailAhead) {
  trail_ = Trail();
  swim_in({-4, 0, -4}, {40, 0, -4});
  Retrace retrace = without_map();
  block(4.1, 4.9);
  BehaviorOutput output = tick(retrace);
  turn_to(M_PI);
  for (; p_W().x() > 4.0 && !output.plan_request; p_W().x() -= 0.05) output = observe(retrace);
  EXPECT_NEAR(p_W().x(), 19.5, 0.15);

  p_W().x() = 40.0;
  block(30.1, 30.9);
  Retrace past_it = without_map();
  output = tick(past_it);
  p_W().x() = 28.0;
  static_cast<void>(tick(past_it));
  for (; p_W().x() > 20.0; p_W().x() -= 0.05) {
    ASSERT_FALSE(observe(past_it).plan_request) << "that is behind it";
  }
}

TEST_F(RetraceTest, EvaluatesTheTrailAheadAlsoIfTheMapStaysAsItIs) {
  trail_ = Trail();
  swim_in({-4, 0, -4}, {40, 0, -4});
  Retrace retrace = without_map();
  block(4.1, 4.9);
  BehaviorOutput output = tick(retrace);
  turn_to(M_PI);
  for (; p_W().x() > 4.0 && !output.plan_request; p_W().x() -= 0.05) {
    now_ += from_seconds(0.1);
    BehaviorInput unchanged = input();
    unchanged.observed = &evaluator_;
    output = retrace.step(unchanged);
  }
  EXPECT_NEAR(p_W().x(), 19.5, 0.3);
}

TEST_F(RetraceTest, FollowsThePathThatWasPlanned) {
  block(4.1, 4.9);
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  for (const planning::PlanStatus status :
       {planning::PlanStatus::kSuccess, planning::PlanStatus::kReduced}) {
    Retrace retrace = with_map();
    ASSERT_TRUE(tick(retrace).plan_request);
    EXPECT_FALSE(retrace.needs_free_ahead());
    const planning::PlanResult found = testing::plan_answer(status, "", north, 0.4);
    const BehaviorOutput output = tick(retrace, &found);
    EXPECT_FALSE(output.plan_request);
    EXPECT_GT(output.command.v, 0.0);
    EXPECT_NEAR(yaw_of(output.command.o), 0.5 * M_PI, 0.01);
    EXPECT_TRUE(retrace.needs_free_ahead());
    EXPECT_EQ(retrace.progress().clearance_m, 0.4);
    EXPECT_NEAR(retrace.progress().distance_to_go_m, 14.0, 1e-9);
    EXPECT_EQ(retrace.progress().plan_failures, 0);
  }
}

TEST_F(RetraceTest, APathThatIsFoundEndsTheFailuresInARow) {
  block(4.1, 4.9);
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  Retrace retrace = with_map();
  ASSERT_TRUE(tick(retrace).plan_request);
  ASSERT_TRUE(tick(retrace, &no_path_).plan_request);
  EXPECT_EQ(retrace.progress().plan_failures, 1);
  const planning::PlanResult found =
      testing::plan_answer(planning::PlanStatus::kSuccess, "", north, 0.4);
  EXPECT_GT(tick(retrace, &found).command.v, 0.0);
  EXPECT_EQ(retrace.progress().plan_failures, 0);
  EXPECT_EQ(retrace.progress().plan_failure, "");
}

TEST_F(RetraceTest, AnAnswerWithoutAPathIsAFailure) {
  block(4.1, 4.9);
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  const std::span<const Pose> all = north;
  for (const planning::PlanResult& answer :
       {testing::plan_answer(planning::PlanStatus::kNoPath, "blocked", all, 0.4),
        testing::plan_answer(planning::PlanStatus::kInvalid, "blocked", all, 0.4),
        testing::plan_answer(planning::PlanStatus::kSuccess, "blocked", all.first(1), 0.4)}) {
    Retrace retrace = with_map();
    ASSERT_TRUE(tick(retrace).plan_request);
    const BehaviorOutput output = tick(retrace, &answer);
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(output.plan_request->limits.clearance, 0.36, 1e-12);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_FALSE(retrace.needs_free_ahead());
    EXPECT_EQ(retrace.progress().plan_failures, 1);
    EXPECT_EQ(retrace.progress().plan_failure, "blocked");
  }
}

TEST_F(RetraceTest, PlansIfItDoesNotGetOnInTime) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  EXPECT_GT(after(60.0 + 4.0 * 11.5 / 0.5, retrace).command.v, 0.0);
  BehaviorOutput output = tick(retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_STREQ(output.plan_cause, "the vehicle makes no progress along its trail");
  EXPECT_EQ(output.command.v, 0.0);
  p_W().z() = -4.1;
  EXPECT_EQ(tick(retrace).command.d, 4.0) << "it keeps its place";
  p_W().z() = -4.0;

  EXPECT_GT(follow_path(retrace, {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)}).command.v, 0.0);
  EXPECT_GT(after(60.0 + 4.0 * 14.0 / 0.5, retrace).command.v, 0.0);
  output = tick(retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_NEAR(output.plan_request->limits.clearance, 0.36, 1e-12);
}

TEST_F(RetraceTest, PlansForAnAlternativeToAPlannedPath) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  EXPECT_TRUE(retrace.request_alternative());
  EXPECT_GT(tick(retrace).command.v, 0.0) << "there is none to its trail";
  clearance_is(0.0);
  ASSERT_TRUE(observe(retrace).plan_request);
  EXPECT_TRUE(retrace.request_alternative());
  EXPECT_FALSE(tick(retrace).plan_request) << "it is being planned";
  const std::vector<Pose> north = {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)};
  EXPECT_GT(follow_path(retrace, north).command.v, 0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0);

  EXPECT_TRUE(retrace.request_alternative());
  const BehaviorOutput output = tick(retrace);
  ASSERT_TRUE(output.plan_request);
  EXPECT_STREQ(output.plan_cause, "the planned path enters space that the sensor cannot observe");
  EXPECT_NEAR(output.plan_request->limits.clearance, 0.36, 1e-12);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_TRUE(retrace.request_alternative());
  p_W().z() = -4.1;
  EXPECT_EQ(tick(retrace).command.d, 4.0) << "it keeps its place";
  p_W().z() = -4.0;
  EXPECT_GT(follow_path(retrace, north).command.v, 0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0) << "asked for once";
}

TEST_F(RetraceTest, PlansWithFullClearanceAgainOnceItHasGotOn) {
  for (const double swum : {0.49, 0.51}) {
    p_W() = {10, 0, -4};
    Retrace retrace = without_map();
    EXPECT_GT(tick(retrace).command.v, 0.0);
    clearance_is(0.0);
    ASSERT_TRUE(observe(retrace).plan_request);
    EXPECT_GT(follow_path(retrace, {pose_at(10, 0), pose_at(10, 3), pose_at(-1, 3)}).command.v,
              0.0);
    p_W().y() = swum;
    clearance_is(0.001);
    EXPECT_GT(observe(retrace).command.v, 0.0);
    clearance_is(0.0);
    const BehaviorOutput output = observe(retrace);
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(output.plan_request->limits.clearance, swum < 0.5 ? 0.36 : 0.6, 1e-12);
  }
}

TEST_F(RetraceTest, MeasuresHowFarItHasGotOnFromWhereThePathBegan) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  clearance_is(0.0);
  for (const double clearance : {0.6, 0.36, 0.18}) {
    const BehaviorOutput output = observe(retrace);
    ASSERT_TRUE(output.plan_request);
    EXPECT_NEAR(output.plan_request->limits.clearance, clearance, 1e-12);
    const double x = p_W().x();
    EXPECT_GT(follow_path(retrace, {pose_at(x, 0), pose_at(x + 9, 0)}).command.v, 0.0);
    p_W().x() += 0.3;
  }
}

TEST_F(RetraceTest, AfterFortyPlannedPathsGettingOnNoLongerCounts) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  clearance_is(0.0);
  BehaviorOutput output = observe(retrace);
  int planned = 0;
  while (output.plan_request && planned < 100) {
    ++planned;
    const double clearance = planned <= 40 ? 1.0 : planned == 41 ? 0.6 : planned == 42 ? 0.3 : 0.1;
    EXPECT_NEAR(output.plan_request->limits.clearance, 0.6 * clearance, 1e-12) << planned;
    const double x = p_W().x();
    EXPECT_GT(follow_path(retrace, {pose_at(x, 0), pose_at(x + 1, 0), pose_at(x + 9, 0)}).command.v,
              0.0);
    p_W().x() += 0.6;
    output = observe(retrace);
  }
  EXPECT_EQ(planned, 43);
  EXPECT_EQ(output.failed, Failure::kExhausted);
}

// From the end of one short planned path to that of the next, none in open water.
TEST_F(RetraceTest, ArrivalsByPlannedPathsCountUnlessTheyLeadBackOntoTheTrail) {
  block(4.1, 4.9);
  for (const bool is_unknown : {false, true}) {
    settings_.recovery.blocked_trail.wait_s = is_unknown ? 90.0 : 0.0;
    p_W() = {8, 0, -4};
    Retrace retrace = with_map();
    int arrivals = 0;
    BehaviorOutput output = wait_for_request(retrace);
    while (arrivals < 20) {
      ASSERT_TRUE(output.plan_request);
      const double y = p_W().y();
      const double on = y < 0.5 ? 1.0 : -1.0;
      EXPECT_GT(follow_path(retrace, {pose_at(8, y), pose_at(8, y + on)}).command.v, 0.0);
      p_W().y() = y + 1.1 * on;
      output = tick(retrace);
      ++arrivals;
      if (output.failed != Failure::kNone) break;
      output = tick(retrace);
      EXPECT_FALSE(retrace.needs_free_ahead()) << "that was the trail again";
    }
    EXPECT_EQ(arrivals, is_unknown ? 20 : 6);
  }
}

}  // namespace
}  // namespace dive::behaviors
