#include "behaviors/trail.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "behaviors/retrace.h"

namespace dive::behaviors {
namespace {

// East in open water to x = 0, then on under a roof to x = 10.
Trail swum_in(double spacing = 0.5, std::size_t capacity = 4096) {
  Trail trail(spacing, capacity);
  for (double x = -4.0; x <= 10.0; x += 0.01) trail.add({x, 0, -4}, x < 0.0);
  return trail;
}

TEST(Trail, LeadsBackToTheLastOpenWater) {
  const Trail::Way way = swum_in().way_out({10.0, 0.3, -4}, 0.0);
  EXPECT_TRUE(way.arrives);
  EXPECT_LT(way.points.back().x(), 0.0);
  EXPECT_GT(way.points.back().x(), -0.55);
  EXPECT_NEAR(way.length_m, 10.3, 0.6);
  for (std::size_t i = 1; i < way.points.size(); ++i) {
    EXPECT_LE((way.points[i] - way.points[i - 1]).norm(), 0.61);
  }
}

TEST(Trail, SaysWhenItNeverSawOpenWater) {
  Trail trail;
  for (double x = 0.0; x < 5.0; x += 0.1) trail.add({x, 0, -4}, false);
  EXPECT_FALSE(trail.way_out({5, 0, -4}, 0.0).arrives);
  EXPECT_FALSE(Trail().way_out({5, 0, -4}, 0.0).arrives);
}

TEST(Trail, StaysBoundedAndKeepsTheWayOut) {
  const Trail trail = swum_in(0.05, 64);
  EXPECT_LE(trail.size(), 64U);
  const Trail::Way way = trail.way_out({10.0, 0, -4}, 0.0);
  EXPECT_TRUE(way.arrives);
  EXPECT_NEAR(way.length_m, 10.0, 1.0);
}

LegSettings settings() {
  LegSettings settings;
  settings.attitude = planning::AttitudeMode::kHorizontal;
  settings.clearance = 0.6;
  return settings;
}

class Judge final : public PathJudge {
 public:
  explicit Judge(double clearance) : clearance_(clearance) {}
  double clearance(std::span<const Pose> /*waypoints*/) override { return clearance_; }

 private:
  double clearance_;
};

BehaviorOutput step(Retrace& retrace, Utime now, const Eigen::Vector3d& p_W,
                    const PlanAnswer* plan = nullptr, PathJudge* seen = nullptr) {
  estimation::StateEstimate estimate;
  estimate.valid = true;
  estimate.X_WB.p = p_W;
  BehaviorInput input;
  input.now = now;
  input.estimate = &estimate;
  input.plan = plan;
  input.seen = seen;
  input.map_changed = seen != nullptr;
  return retrace.step(input);
}

// In along y = 0 to x = 20, and half of the way back along y = 0.3.
TEST(Trail, LeavesOutWhereItHasBeenTwice) {
  Trail trail;
  for (double x = -4.0; x <= 20.0; x += 0.1) trail.add({x, 0, -4}, x < 0.0);
  for (double x = 20.0; x >= 10.0; x -= 0.1) trail.add({x, 0.3, -4}, false);
  const Eigen::Vector3d here(10.0, 0.3, -4);
  const Trail::Way there_and_back = trail.way_out(here, 0.0);
  EXPECT_NEAR(there_and_back.length_m, 30.0, 1.0);
  const Trail::Way straight_out = trail.way_out(here, 0.6);
  EXPECT_TRUE(straight_out.arrives);
  EXPECT_NEAR(straight_out.length_m, 10.3, 0.8);
  EXPECT_EQ(straight_out.points.front(), here);
  EXPECT_LT(straight_out.points.back().x(), 0.0);
  for (std::size_t i = 1; i < straight_out.points.size(); ++i) {
    EXPECT_LE((straight_out.points[i] - straight_out.points[i - 1]).norm(), 0.61);
  }
}

TEST(Trail, KnowsHowFarInItIs) {
  const Trail trail = swum_in();
  EXPECT_NEAR(trail.penetration_m(), 10.0, 0.6);
  Trail out = trail;
  out.add({-1, 0, -4}, true);
  EXPECT_EQ(out.penetration_m(), 0.0);
}

TEST(Retrace, IsDoneAtOnceInOpenWater) {
  const Trail trail;
  Retrace retrace(trail, settings(), nullptr);
  estimation::StateEstimate estimate;
  estimate.valid = true;
  estimate.X_WB.p = {0, 0, -3};
  BehaviorInput input;
  input.estimate = &estimate;
  input.can_go_up = true;
  EXPECT_TRUE(retrace.step(input).done);
}

TEST(Retrace, StopsBeforeItBelievesInOpenWater) {
  const Trail trail = swum_in();
  Retrace retrace(trail, settings(), nullptr);
  estimation::StateEstimate estimate;
  estimate.valid = true;
  estimate.X_WB.p = {-0.5, 0, -4};
  estimate.v_WB_B.x() = 0.4;
  BehaviorInput input;
  input.estimate = &estimate;
  input.can_go_up = true;
  EXPECT_FALSE(retrace.step(input).done) << "it still coasts";
  EXPECT_EQ(retrace.step(input).command.v, 0.0);
  estimate.X_WB.p.x() = 0.1;  // under the roof after all
  estimate.v_WB_B.x() = 0.05;
  input.can_go_up = false;
  input.now = from_seconds(1);
  EXPECT_GT(retrace.step(input).command.v, 0.0) << "back along the trail";
}

TEST(Retrace, FailsWhenThereIsNoWayOut) {
  const Trail trail;
  Retrace retrace(trail, settings(), nullptr);
  const BehaviorOutput output = step(retrace, 0, {0, 0, -3});
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_FALSE(output.done);
}

TEST(Retrace, SwimsBackAlongTheTrail) {
  const Trail trail = swum_in();
  Retrace retrace(trail, settings(), nullptr);
  const BehaviorOutput output = step(retrace, 0, {10, 0, -4});
  EXPECT_EQ(output.failed, Failure::kNone);
  EXPECT_FALSE(output.plan_request);
  EXPECT_LT((output.command.o * Eigen::Vector3d::UnitX()).x(), -0.9) << "the way out is west";
  EXPECT_NEAR(output.command.d, 4.0, 1e-6);
}

TEST(Retrace, PlansAWayOutWhenItDoesNotGetOn) {
  const Trail trail = swum_in();
  Retrace retrace(trail, settings(), nullptr);
  Utime now = 0;
  BehaviorOutput output = step(retrace, now, {10, 0, -4});
  while (!output.plan_request && now < from_seconds(1000)) {
    now += from_seconds(1.0);
    output = step(retrace, now, {9.5, 0, -4});  // stuck
  }
  ASSERT_TRUE(output.plan_request);
  EXPECT_NEAR(to_seconds(now), 60.0 + 4 * 11.5 / 0.4, 10.0);
  EXPECT_LT(output.plan_request->goal.p.x(), 0.0) << "to the open water of the trail";
  EXPECT_EQ(output.command.v, 0.0);
}

TEST(Retrace, AroundWhatBlocksTheTrailWithLessAndLessClearance) {
  Judge blocked(-0.1);
  const Trail trail = swum_in();
  Retrace retrace(trail, settings(), &blocked);
  BehaviorOutput output = step(retrace, 0, {10, 0, -4});
  ASSERT_TRUE(output.plan_request);
  EXPECT_EQ(output.plan_request->clearance, 0.6);
  const PlanAnswer none{planning::PlanStatus::kNoPath, "too tight", {}, 0.0};
  output = step(retrace, 20'000, {10, 0, -4}, &none);
  ASSERT_TRUE(output.plan_request);
  EXPECT_NEAR(output.plan_request->clearance, 0.36, 1e-12);

  const std::vector<Pose> round = {
      {{10, 0, -4}, from_rpy(0, 0, 1.57)}, {{10, 5, -4}, {}}, {{-1, 5, -4}, {}}};
  const PlanAnswer found{planning::PlanStatus::kSuccess, "", round, 0.4};
  output = step(retrace, 40'000, {10, 0, -4}, &found);
  EXPECT_EQ(output.failed, Failure::kNone);
  EXPECT_GT((output.command.o * Eigen::Vector3d::UnitX()).y(), 0.9) << "round it, by the north";
  EXPECT_EQ(retrace.progress().clearance_m, 0.4);
}

// Somebody in the way, between x = 4 and x = 5, until they are gone.
class Somebody final : public PathJudge {
 public:
  double clearance(std::span<const Pose> waypoints) override {
    for (std::size_t i = 1; i < waypoints.size() && is_there; ++i) {
      const auto [low, high] = std::minmax(waypoints[i - 1].p.x(), waypoints[i].p.x());
      if (high > 4.0 && low < 5.0 && std::abs(waypoints[i].p.y()) < 0.5) return -0.1;
    }
    return 2.0;
  }
  bool is_there = true;
};

LegSettings patient() {
  LegSettings patient = settings();
  patient.way_out_wait_s = 90.0;
  return patient;
}

TEST(Retrace, InUnknownWaterItLooksFirstAndThenPlansBackOntoTheTrail) {
  Somebody somebody;
  const Trail trail = swum_in();
  Retrace retrace(trail, patient(), &somebody);
  Utime now = 0;
  BehaviorOutput output = step(retrace, now, {8, 0, -4});
  for (; !output.plan_request && now < from_seconds(60); now += from_seconds(0.5)) {
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_LT((output.command.o * Eigen::Vector3d::UnitX()).x(), -0.9) << "to where it came from";
    output = step(retrace, now, {8, 0, -4});
  }
  ASSERT_TRUE(output.plan_request);
  EXPECT_GE(to_seconds(now), 15.0);
  EXPECT_LT(output.plan_request->goal.p.x(), 4.0);
  EXPECT_GT(output.plan_request->goal.p.x(), 2.0) << "no farther than it must leave the trail";
  EXPECT_LT(output.plan_request->max_z, -3.5) << "above nothing is known";

  const std::vector<Pose> round = {
      {{8, 0, -4}, from_rpy(0, 0, 1.57)}, {{8, 2, -4}, {}}, {{3, 0, -4}, {}}};
  const PlanAnswer found{planning::PlanStatus::kSuccess, "", round, 0.4};
  output = step(retrace, now, {8, 0, -4}, &found);
  EXPECT_GT((output.command.o * Eigen::Vector3d::UnitX()).y(), 0.9);
  EXPECT_TRUE(retrace.needs_sight());
  EXPECT_TRUE(retrace.take_another_way()) << "it does not see where that leads";
  output = step(retrace, now += 20'000, {8, 0, -4});
  ASSERT_TRUE(output.plan_request);
  EXPECT_NEAR(output.plan_request->clearance, 0.36, 1e-12) << "with less clearance";
}

TEST(Retrace, InUnknownWaterItGoesOnWhenTheWayIsFreeAgain) {
  Somebody somebody;
  const Trail trail = swum_in();
  Retrace retrace(trail, patient(), &somebody);
  EXPECT_EQ(step(retrace, 0, {8, 0, -4}).command.v, 0.0);
  somebody.is_there = false;
  EXPECT_EQ(step(retrace, from_seconds(3), {8, 0, -4}).command.v, 0.0);
  static_cast<void>(step(retrace, from_seconds(6), {8, 0, -4}));
  EXPECT_GT(step(retrace, from_seconds(6.02), {8, 0, -4}).command.v, 0.0);
  EXPECT_FALSE(retrace.needs_sight());
}

TEST(Retrace, InUnknownWaterAnAnswerThatComesWhenItIsOnItsTrailAgainIsTooLate) {
  Somebody somebody;
  const Trail trail = swum_in();
  Retrace retrace(trail, patient(), &somebody);
  Utime now = 0;
  bool has_asked = false;
  BehaviorOutput output = step(retrace, now, {8, 0, -4});
  while (output.command.v == 0.0 && now < from_seconds(89)) {
    has_asked |= output.plan_request.has_value();
    somebody.is_there = now < from_seconds(60);  // by then it has given up on the planner
    output = step(retrace, now += from_seconds(0.5), {8, 0, -4});
  }
  ASSERT_TRUE(has_asked);
  ASSERT_GT(output.command.v, 0.0);
  const std::vector<Pose> round = {
      {{8, 0, -4}, from_rpy(0, 0, 1.57)}, {{8, 5, -4}, {}}, {{3, 5, -4}, {}}};
  const PlanAnswer late{planning::PlanStatus::kSuccess, "", round, 0.4};
  output = step(retrace, now += 20'000, {8, 0, -4}, &late);
  EXPECT_FALSE(retrace.needs_sight());
  EXPECT_LT((output.command.o * Eigen::Vector3d::UnitX()).x(), -0.9) << "along the trail";
}

// By the time that it is there it may be gone, and a long trail cannot be judged in one tick.
TEST(Retrace, WhatIsInTheWayFarAheadIsLeftUntilItIsNearer) {
  Somebody somebody;
  Trail trail;
  for (double x = -4.0; x <= 40.0; x += 0.1) trail.add({x, 0, -4}, x < 0.0);
  Retrace retrace(trail, patient(), &somebody);
  EXPECT_GT(step(retrace, 0, {40, 0, -4}, nullptr, &somebody).command.v, 0.0);
  Utime now = 0;
  double x = 40.0;
  while (x > 10.0 && step(retrace, now += 20'000, {x, 0, -4}, nullptr, &somebody).command.v > 0.0) {
    x -= 0.02;
  }
  EXPECT_GT(x, 15.0);
  EXPECT_LT(x, 25.0);
}

TEST(Retrace, WhereNothingBlocksTheTrailAndItDoesNotGetOnItPlansOnAlongIt) {
  Judge open(2.0);
  const Trail trail = swum_in();
  Retrace retrace(trail, patient(), &open);
  BehaviorOutput output;
  for (Utime now = 0; !output.plan_request && now < from_seconds(1500);) {
    output = step(retrace, now += from_seconds(0.5), {8, 0, -4});
    ASSERT_EQ(output.failed, Failure::kNone);
  }
  ASSERT_TRUE(output.plan_request);
  EXPECT_NEAR(output.plan_request->goal.p.x(), 5.0, 0.6) << "not where it is";
  EXPECT_NEAR(output.plan_request->goal.p.y(), 0.0, 1e-9);
}

TEST(Retrace, EvenInUnknownWaterItDoesNotWaitForEver) {
  Judge blocked(-0.1);
  const Trail trail = swum_in();
  Retrace retrace(trail, patient(), &blocked);
  const PlanAnswer none{planning::PlanStatus::kNoPath, "too tight", {}, 0.0};
  Utime now = 0;
  BehaviorOutput output = step(retrace, now, {8, 0, -4});
  while (output.failed == Failure::kNone && now < from_seconds(200)) {
    now += from_seconds(0.5);
    output = step(retrace, now, {8, 0, -4}, output.plan_request ? &none : nullptr);
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_NEAR(to_seconds(now), 90.0, 8.0);
  EXPECT_EQ(retrace.progress().plan_failure, "too tight");
}

TEST(Retrace, WithoutAttitudeItWaitsOrGoesUp) {
  const Trail trail = swum_in();
  Retrace retrace(trail, settings(), nullptr);
  estimation::StateEstimate estimate;
  estimate.valid = true;
  estimate.X_WB.p = {10, 0, -4};
  BehaviorInput input;
  input.estimate = &estimate;
  input.attitude_known = false;
  for (; input.now < from_seconds(1000); input.now += from_seconds(1)) {
    const BehaviorOutput output = retrace.step(input);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.failed, Failure::kNone);
    EXPECT_FALSE(output.done || output.plan_request);
  }
  input.attitude_known = true;  // it comes back, and the time did not count
  EXPECT_FALSE(retrace.step(input).plan_request);
  EXPECT_GT(retrace.step(input).command.v, 0.0);
  input.attitude_known = false;
  input.can_go_up = true;
  EXPECT_TRUE(retrace.step(input).done);
}

TEST(Retrace, APlannerThatDoesNotAnswerIsNoWayOut) {
  Judge blocked(-0.1);
  const Trail trail = swum_in();
  Retrace retrace(trail, settings(), &blocked);
  BehaviorOutput output;
  Utime now = 0;
  for (; output.failed == Failure::kNone && now < from_seconds(100); now += from_seconds(1)) {
    output = step(retrace, now, {10, 0, -4});
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_NEAR(to_seconds(now), 4 * 11, 3.0);
}

TEST(Retrace, WithoutAnyWayItSaysSo) {
  Judge still(-0.1);
  const Trail trail = swum_in();
  Retrace retrace(trail, settings(), nullptr);
  BehaviorOutput output = step(retrace, 0, {10, 0, -4});
  EXPECT_FALSE(output.plan_request);
  output = step(retrace, 20'000, {10, 0, -4}, nullptr, &still);  // it falls in front of the vehicle
  const PlanAnswer none{planning::PlanStatus::kNoPath, "blocked by seen 1", {}, 0.0};
  int asked = 0;
  for (Utime now = 40'000; output.failed == Failure::kNone && now < 1'000'000; now += 20'000) {
    ASSERT_TRUE(output.plan_request);
    ++asked;
    output = step(retrace, now, {10, 0, -4}, &none);
  }
  EXPECT_EQ(output.failed, Failure::kExhausted);
  EXPECT_EQ(asked, 4);
  EXPECT_EQ(retrace.progress().plan_failure, "blocked by seen 1");
}

}  // namespace
}  // namespace dive::behaviors
