#include "behaviors/leg.h"

#include <gtest/gtest.h>

#include "behaviors/goal_sequence.h"
#include "test/behaviors/leg_sample.h"

namespace dive::behaviors {
namespace {

TEST(Leg, AsksOnceWaitsThenFollowsToTheGoal) {
  Leg leg(settings(), goal_at(6, 0));
  PerfectVehicle vehicle({0, 0, -3});
  const BehaviorOutput first = vehicle.tick(leg);
  ASSERT_TRUE(first.plan_request);
  EXPECT_EQ(first.plan_request->limits.clearance, 1.0);
  EXPECT_EQ(first.plan_request->limits.min_z, -10.0);
  EXPECT_TRUE(first.plan_request->previous.empty());
  EXPECT_EQ(first.command.v, 0.0) << "no path, no way";
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(vehicle.tick(leg).plan_request);

  const std::vector<Pose> path = straight({0, 0, -3}, {6, 0, -3});
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  EXPECT_EQ(leg.progress().clearance_m, 1.2);
  for (int i = 0; i < 2000 && !output.done; ++i) output = vehicle.tick(leg);
  EXPECT_TRUE(output.done);
  EXPECT_LT((vehicle.position() - Eigen::Vector3d(6, 0, -3)).norm(), 0.5);
}

TEST(Leg, LeavesItsDepthsByNoMoreThanTheMissionAllows) {
  LegSettings limited = settings();
  limited.max_rise = 0.2;
  limited.max_drop = 0.1;
  Leg leg(limited, goal_at(6, 0));
  PerfectVehicle vehicle({0, 0, -3.5});
  const BehaviorOutput first = vehicle.tick(leg);
  ASSERT_TRUE(first.plan_request);
  EXPECT_NEAR(first.plan_request->limits.max_z, -2.8, 1e-12);
  EXPECT_NEAR(first.plan_request->limits.min_z, -3.6, 1e-12);

  const auto limits_from = [&](double z) {
    return leg_request(limited, goal_at(6, 0), Pose{{0, 0, z}, {1, 0, 0, 0}}).limits;
  };
  EXPECT_NEAR(limits_from(-1.0).max_z, -0.8, 1e-12);
  EXPECT_NEAR(limits_from(-1.0).min_z, -3.1, 1e-12);
  limited.limits.max_z = -2.9;
  limited.limits.min_z = -3.05;
  EXPECT_EQ(limits_from(-5.0).max_z, -2.9) << "the other limits stay";
  EXPECT_EQ(limits_from(-1.0).min_z, -3.05);
}

// A vehicle that is outside when it plans again starts where it is.
TEST(Leg, PlansFromOutsideOfItsDepthsToo) {
  LegSettings limited = settings();
  limited.max_rise = 0.2;
  limited.max_drop = 0.1;
  limited.replan.period_s = 1.0;
  Leg leg(limited, goal_at(6, 0));
  PerfectVehicle vehicle({0, 0, -3});
  const auto requested_at = [&](double z) {
    const planning::PlanResult answer = success(straight({0, 0, z}, {6, 0, -3}));
    BehaviorOutput output = vehicle.tick(leg, &answer);
    for (int i = 0; i < 200 && !output.plan_request; ++i) {
      vehicle.move_to({1, 0, z});
      output = vehicle.tick(leg);
    }
    EXPECT_TRUE(output.plan_request);
    return output.plan_request.value_or(planning::PlanRequest{}).limits;
  };
  ASSERT_TRUE(vehicle.tick(leg).plan_request);
  EXPECT_NEAR(requested_at(-3.4).min_z, -3.4, 1e-12);
  EXPECT_NEAR(requested_at(-3.0).min_z, -3.1, 1e-12);
  EXPECT_NEAR(requested_at(-2.5).max_z, -2.5, 1e-12);
}

// Under water a vehicle that has drifted too near to something must get away from it.
TEST(Leg, AcceptsAndFollowsAReducedPath) {
  Leg leg(settings(), goal_at(6, 0));
  PerfectVehicle vehicle({0, 0, -3});
  const BehaviorOutput first = vehicle.tick(leg);
  ASSERT_TRUE(first.plan_request);
  EXPECT_EQ(first.plan_request->limits.reduced_clearance, 0.0);
  const std::vector<Pose> path = straight({0, 0, -3}, {6, 0, -3});
  const planning::PlanResult answer =
      testing::plan_answer(planning::PlanStatus::kReduced, "the start is near", path, 0.3);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  for (int i = 0; i < 100; ++i) output = vehicle.tick(leg);
  EXPECT_GT(output.command.v, 0.0);
  EXPECT_GT(vehicle.position().x(), 0.1);
  EXPECT_EQ(leg.progress().clearance_m, 0.3);
  EXPECT_EQ(leg.progress().plan_failures, 0);
}

TEST(Leg, DwellsAtTheGoal) {
  LegGoal goal = goal_at(3, 0);
  goal.dwell_s = 5.0;
  Leg leg(settings(), goal);
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {3, 0, -3});
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  double arrived = 0;
  for (int i = 0; i < 3000 && !output.done; ++i) {
    output = vehicle.tick(leg);
    if (arrived == 0 && output.command.v == 0.0) arrived = vehicle.seconds();
  }
  EXPECT_NEAR(vehicle.seconds() - arrived, 5.0, 0.05);
}

// A replan that was under way when the vehicle arrived must not change what it does at the goal.
TEST(Leg, AtTheGoalIgnoresAnAnswerThatComesLate) {
  for (const bool has_path : {true, false}) {
    LegSettings with_period = settings();
    with_period.replan.period_s = 2.0;
    LegGoal goal = goal_at(1.2, 0);
    goal.dwell_s = 5.0;
    Leg leg(with_period, goal);
    PerfectVehicle vehicle({0, 0, -3});
    EXPECT_TRUE(vehicle.tick(leg).plan_request);
    const std::vector<Pose> path = straight({0, 0, -3}, {1.2, 0, -3});
    planning::PlanResult answer = success(path);
    BehaviorOutput output = vehicle.tick(leg, &answer);
    bool has_asked = false;
    while (leg.progress().distance_to_go_m > 0.0 && vehicle.seconds() < 60.0) {
      output = vehicle.tick(leg);
      has_asked |= output.plan_request.has_value();
    }
    ASSERT_TRUE(has_asked);
    const std::vector<Pose> north = straight(vehicle.position(), {1.2, 9, -7});
    answer = has_path ? success(north)
                      : testing::plan_answer(planning::PlanStatus::kNoPath, "late", {}, 0.0);
    output = vehicle.tick(leg, &answer);
    EXPECT_FALSE(output.done || output.plan_request);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 3.0);
    EXPECT_NEAR(to_rpy(output.command.o).z(), 0.0, 1e-9);
    EXPECT_EQ(leg.progress().plan_failures, 0);
  }
}

TEST(Leg, KeepsTheOldPathWhileAndAfterAReplanFails) {
  LegSettings with_period = settings();
  with_period.replan.period_s = 3.0;
  Leg leg(with_period, goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {20, 0, -3});
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  while (!output.plan_request && vehicle.seconds() < 10) output = vehicle.tick(leg);
  ASSERT_TRUE(output.plan_request);
  EXPECT_FALSE(output.plan_request->previous.empty()) << "warm-started from the path it has";
  EXPECT_LT((output.plan_request->previous.back().p - path.back().p).norm(), 1e-12);
  EXPECT_GT(output.command.v, 0.1);
  const planning::PlanResult failure =
      testing::plan_answer(planning::PlanStatus::kNoPath, "blocked", {}, 0.0);
  output = vehicle.tick(leg, &failure);
  EXPECT_GT(output.command.v, 0.1);
  EXPECT_EQ(leg.progress().plan_failures, 1);
  EXPECT_EQ(leg.progress().plan_failure, "blocked");
}

TEST(Leg, OffersItsTrailToThePlanner) {
  Trail trail;
  for (int x = 0; x <= 10; ++x) trail.add({1.0 * x, 0, -3}, false);
  PerfectVehicle vehicle({10, 0, -3});
  vehicle.set_map(nullptr, &trail);
  Leg back(settings(), goal_at(0, 0));
  const BehaviorOutput output = vehicle.tick(back);
  ASSERT_TRUE(output.plan_request);
  EXPECT_TRUE(output.plan_request->previous.empty());
  ASSERT_GE(output.plan_request->trail.size(), 10U);
  EXPECT_EQ(output.plan_request->trail.back().p, Eigen::Vector3d(0, 0, -3));
  Leg on(settings(), goal_at(20, 0));
  EXPECT_TRUE(vehicle.tick(on).plan_request->trail.empty());
}

TEST(Leg, APlannerThatDoesNotAnswerHasFailed) {
  Leg leg(settings(), goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  Failure failed = Failure::kNone;
  while (failed == Failure::kNone && vehicle.seconds() < 60) failed = vehicle.tick(leg).failed;
  EXPECT_EQ(failed, Failure::kUnreachable);
  EXPECT_NEAR(vehicle.seconds(), 21.0, 0.2) << "twice ten seconds, and one between";
  EXPECT_EQ(leg.progress().plan_failure, "the planner did not answer within 10 s");
}

TEST(Leg, RetriesAFailedFirstPlanThenGivesUp) {
  LegSettings few = settings();
  few.replan.max_replans = 4;
  Leg leg(few, goal_at(20, 0));
  PerfectVehicle vehicle({0, 0, -3});
  const planning::PlanResult failure =
      testing::plan_answer(planning::PlanStatus::kNoPath, "blocked", {}, 0.0);
  int asked = 0;
  std::vector<std::uint64_t> seeds;
  BehaviorOutput output;
  int unreachable = 0;
  while (output.failed != Failure::kExhausted && vehicle.seconds() < 60) {
    const bool answer = output.plan_request.has_value();
    output = vehicle.tick(leg, answer ? &failure : nullptr);
    EXPECT_EQ(output.command.v, 0.0);
    if (output.failed == Failure::kUnreachable) {
      ++unreachable;
      EXPECT_EQ(leg.progress().plan_failures, 2);
    }
    if (output.plan_request) {
      ++asked;
      seeds.push_back(output.plan_request->seed);
    }
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_EQ(unreachable, 1) << "reported once, and still tried again";
  EXPECT_EQ(asked, 5) << "the first and four more";
  EXPECT_EQ(leg.progress().plan_failures, 5);
  EXPECT_NE(seeds[0], seeds[1]) << "another try must be able to end otherwise";
  EXPECT_GE(vehicle.seconds(), 4.0) << "one second between tries";
}

TEST(Leg, PlansAgainWhenItMissedTheGoal) {
  Leg leg(settings(), goal_at(4, 0));
  PerfectVehicle vehicle({0, 0, -3});
  EXPECT_TRUE(vehicle.tick(leg).plan_request);
  const std::vector<Pose> path = straight({0, 0, -3}, {4, 0, -3});
  const planning::PlanResult answer = success(path);
  BehaviorOutput output = vehicle.tick(leg, &answer);
  vehicle.move_to({4.5, 2.0, -3});  // swept past it, abeam
  for (int i = 0; i < 50 && !output.plan_request; ++i) output = vehicle.tick(leg);
  ASSERT_TRUE(output.plan_request);
  EXPECT_FALSE(output.done);
}

TEST(GoalSequence, TakesItsGoalsInOrder) {
  GoalSequence sequence(settings(), {goal_at(3, 0), goal_at(3, 3)});
  PerfectVehicle vehicle({0, 0, -3});
  std::vector<Eigen::Vector3d> asked;
  std::vector<Pose> path;
  planning::PlanResult answer;
  BehaviorOutput output;
  for (int i = 0; i < 4000 && !output.done; ++i) {
    const bool answered = output.plan_request.has_value();
    if (answered) {
      asked.push_back(output.plan_request->goal.p);
      path = straight(output.plan_request->start.p, output.plan_request->goal.p);
      answer = success(path);
    }
    output = vehicle.tick(sequence, answered ? &answer : nullptr);
  }
  EXPECT_TRUE(output.done);
  ASSERT_GE(asked.size(), 2U);
  EXPECT_EQ(asked.front(), Eigen::Vector3d(3, 0, -3));
  EXPECT_EQ(asked.back(), Eigen::Vector3d(3, 3, -3));
  EXPECT_LT((vehicle.position() - Eigen::Vector3d(3, 3, -3)).norm(), 0.5);
}

}  // namespace
}  // namespace dive::behaviors
