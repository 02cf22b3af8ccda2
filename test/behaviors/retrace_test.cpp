#include "behaviors/retrace.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "test/behaviors/retrace_sample.h"

namespace dive::behaviors {
namespace {

TEST_F(RetraceTest, WithNothingOverheadIsDoneOnceItHasStopped) {
  can_go_up_ = true;
  estimate_.v_WB_B = {0.1, 0.2, 0};
  Retrace retrace = without_map();
  BehaviorOutput output = tick(retrace);
  EXPECT_FALSE(output.done);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_EQ(output.command.d, 4.0);
  EXPECT_NEAR(yaw_of(output.command.o), std::atan2(0.2, 0.1), 1e-9) << "bow along its drift";
  estimate_.v_WB_B = {0, 0.081, 0};
  EXPECT_FALSE(tick(retrace).done);
  estimate_.v_WB_B = {0, 0.079, 0};
  output = tick(retrace);
  EXPECT_TRUE(output.done);
  EXPECT_EQ(output.failed, Failure::kNone);
  EXPECT_EQ(output.command.v, 0.0);
}

TEST_F(RetraceTest, WithNothingOverheadIsDoneAfterFourSecondsWhateverIsEstimated) {
  can_go_up_ = true;
  speed() = 0.4;
  p_W().z() = 0.1;
  Retrace retrace = without_map();
  const BehaviorOutput output = tick(retrace);
  EXPECT_FALSE(output.done);
  EXPECT_EQ(output.command.d, 0.0);
  EXPECT_FALSE(after(4.0, retrace).done);
  EXPECT_TRUE(tick(retrace).done);
}

TEST_F(RetraceTest, DoesNotMistakeTheEdgeOfAnOverheadForOpenWater) {
  p_W() = {-0.1, 0, -4};
  can_go_up_ = true;
  speed() = 0.4;
  Retrace retrace = without_map();
  EXPECT_FALSE(tick(retrace).done);
  p_W() = {0.1, 0, -4};
  can_go_up_ = false;
  speed() = 0.0;
  const BehaviorOutput output = tick(retrace);
  EXPECT_FALSE(output.done);
  EXPECT_GT(output.command.v, 0.0) << "back along the trail";
}

TEST_F(RetraceTest, StopsAsItIsThenComesLevelThenTurnsBack) {
  const Eigen::Quaterniond rolled = from_rpy(-1.0, 0.2, 0.1);
  estimate_.X_WB.q = rolled;
  speed() = 0.4;
  Retrace retrace = without_map();
  BehaviorOutput output = tick(retrace);
  EXPECT_EQ(output.command.v, 0.0);
  EXPECT_LT(angle_between(output.command.o, rolled), 1e-9);
  estimate_.X_WB = {{10.1, 0, -4.1}, from_rpy(-0.5, 0.1, 0.2)};
  speed() = 0.081;
  output = tick(retrace);
  EXPECT_EQ(output.command.d, 4.0);
  EXPECT_LT(angle_between(output.command.o, rolled), 1e-9) << "as it was";

  estimate_.X_WB = {{10.2, 0, -4.2}, from_rpy(-0.5, 0.1, 0.3)};
  speed() = 0.079;
  const auto expect_comes_level = [&] {
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.2) << "where it has stopped";
    EXPECT_LT(angle_between(output.command.o, from_rpy(0, 0, 0.3)), 1e-9);
  };
  output = tick(retrace);
  expect_comes_level();
  estimate_.X_WB = {{10.2, 0, -4.3}, from_rpy(0.16, 0, 0.35)};
  output = tick(retrace);
  expect_comes_level();
  estimate_.X_WB.q = from_rpy(0, 0, 0.35);
  estimate_.omega_WB_B = {0, 0, 0.21};
  output = tick(retrace);
  expect_comes_level();

  estimate_.X_WB.q = from_rpy(0.14, 0, 0.35);
  estimate_.omega_WB_B = {0, 0, 0.19};
  output = tick(retrace);
  EXPECT_GT(output.command.v, 0.0);
  EXPECT_NEAR(std::abs(yaw_of(output.command.o)), M_PI, 0.1) << "west, where it came from";
  estimate_.X_WB.q = from_rpy(1.0, 0, M_PI);
  speed() = 0.4;
  EXPECT_GT(tick(retrace).command.v, 0.0) << "once is enough";
}

TEST_F(RetraceTest, TakesFourSecondsToStopAndFourToComeLevelAtMost) {
  estimate_.X_WB.q = from_rpy(1.0, 0, 0);
  speed() = 0.4;
  Retrace retrace = without_map();
  const auto roll = [](const BehaviorOutput& output) { return to_rpy(output.command.o).x(); };
  EXPECT_NEAR(roll(tick(retrace)), 1.0, 1e-9);
  EXPECT_NEAR(roll(after(4.0, retrace)), 1.0, 1e-9);
  EXPECT_NEAR(roll(tick(retrace)), 0.0, 1e-9);
  EXPECT_EQ(after(4.0, retrace).command.v, 0.0);
  EXPECT_GT(tick(retrace).command.v, 0.0);
}

TEST_F(RetraceTest, FollowsTheTrailOutAndAMetreOn) {
  Retrace retrace = without_map();
  EXPECT_EQ(retrace.progress().goal, "open water");
  BehaviorOutput output = tick(retrace);
  EXPECT_NEAR(retrace.progress().distance_to_go_m, 11.5, 1e-9);
  EXPECT_EQ(retrace.progress().segment, 1);
  double fastest = 0.0;
  double farthest_off = 0.0;
  while (!output.done && to_seconds(now_) < 100.0) {
    obey(output.command);
    if (std::abs(p_W().x() - 5.0) < 0.01) p_W().y() = 0.2;
    can_go_up_ = p_W().x() < 0.0;
    output = tick(retrace);
    ASSERT_EQ(output.failed, Failure::kNone);
    ASSERT_FALSE(output.plan_request);
    EXPECT_FALSE(retrace.needs_free_ahead());
    fastest = std::max(fastest, output.command.v);
    farthest_off = std::max(farthest_off, retrace.progress().cross_track_m);
  }
  EXPECT_TRUE(output.done);
  EXPECT_NEAR(p_W().x(), -1.5, 0.1);
  EXPECT_EQ(fastest, 0.5);
  EXPECT_NEAR(farthest_off, 0.2, 0.01);
  EXPECT_LT(retrace.progress().distance_to_go_m, 0.1);
  EXPECT_EQ(retrace.progress().segment, 23);
}

// Half of the way out, a loop closure finds that the vehicle is 1 m farther north than it believed,
// and with it the inner half of the trail.
TEST_F(RetraceTest, FollowsTheTrailWhereALoopClosureHasMovedIt) {
  Retrace retrace = without_map();
  BehaviorOutput output = tick(retrace);
  while (p_W().x() > 5.0) {
    obey(output.command);
    output = tick(retrace);
  }
  const PlanarTransform by{0.0, {0.0, 1.0}};
  trail_.move({{{0, by}}});
  p_W() = by * p_W();
  BehaviorInput moved = input();
  moved.trail_moved = true;
  output = retrace.step(moved);
  EXPECT_LT(retrace.progress().cross_track_m, 1e-6);
  double farthest_off = 0.0;
  while (!output.done && to_seconds(now_) < 100.0) {
    obey(output.command);
    can_go_up_ = p_W().x() < 0.0;
    output = tick(retrace);
    ASSERT_EQ(output.failed, Failure::kNone);
    farthest_off = std::max(farthest_off, std::abs(p_W().y() - 1.0));
  }
  EXPECT_TRUE(output.done);
  EXPECT_LT(farthest_off, 0.05);
}

// An obstacle that appeared in open water waits at the end of its way.
TEST_F(RetraceTest, EndsItsWayShortOfAnObstacleInOpenWaterIfThatIsEnough) {
  const auto length_m = [&](double obstacle_x) {
    evaluator_.at = [=](const Eigen::Vector3d& p_W) { return p_W.x() < obstacle_x ? 0.2 : 2.0; };
    Retrace retrace = with_map();
    EXPECT_FALSE(tick(retrace).plan_request);
    return retrace.progress().distance_to_go_m;
  };
  EXPECT_NEAR(length_m(-1.6), 11.5, 1e-9);
  EXPECT_NEAR(length_m(-1.3), 11.0, 1e-9) << "at the breadcrumb before";
  EXPECT_NEAR(length_m(-0.6), 10.5, 1e-9) << "at the first one in open water";
  EXPECT_NEAR(length_m(100.0), 11.5, 1e-9) << "where none is clear, the farthest";
}

TEST_F(RetraceTest, IsNotAtTheEndOfAShortPathWhileItTurns) {
  evaluator_.at = [](const Eigen::Vector3d& p_W) { return p_W.x() < -0.6 ? 0.2 : 2.0; };
  estimate_.X_WB = pose_at(-0.2, 0);
  Retrace retrace = with_map();
  for (int i = 0; i < 20; ++i) {  // carried away from it
    EXPECT_EQ(tick(retrace).failed, Failure::kNone) << i;
    EXPECT_LT(retrace.progress().distance_to_go_m, 0.8) << i;
    p_W().x() += 0.02;
  }
}

TEST_F(RetraceTest, PlansAroundWhatAScanShowsInItsWay) {
  Retrace retrace = with_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  now_ += from_seconds(kTick);
  BehaviorInput scanned = input();
  scanned.obstacle_ahead = true;
  const BehaviorOutput output = retrace.step(scanned);
  EXPECT_EQ(output.command.v, 0.0);
  ASSERT_TRUE(output.plan_request);
  EXPECT_STREQ(output.plan_cause, "the trail is blocked");
}

// There and back, side by side: what is nearer than 80 % of D_min may be linked.
TEST_F(RetraceTest, LeavesOutWhatLiesBetweenNearPartsOfTheTrail) {
  for (const double beside : {0.47, 0.49}) {
    trail_ = Trail();
    swim_in({-4, 0, -4}, {10, 0, -4});
    swim_in({10, beside, -4}, {5, beside, -4});
    Retrace retrace = without_map();
    static_cast<void>(tick(retrace));
    EXPECT_NEAR(retrace.progress().distance_to_go_m, beside < 0.48 ? 6.97 : 16.70, 1e-3);
  }
}

TEST_F(RetraceTest, WhereItArrivesItStopsAgainAndIsDoneIfNothingIsOverhead) {
  for (const bool stops : {true, false}) {
    can_go_up_ = false;
    estimate_.X_WB = pose_at(10, 0);
    speed() = 0.0;
    Retrace retrace = without_map();
    EXPECT_GT(tick(retrace).command.v, 0.0);
    estimate_.X_WB = {{-1.4, 0, -4.5}, from_rpy(0, 0, 3.0)};
    speed() = 0.4;
    can_go_up_ = true;
    EXPECT_GT(tick(retrace).command.v, 0.0) << "not there yet";
    p_W().x() = -1.6;
    EXPECT_FALSE(tick(retrace).done);
    BehaviorOutput output = after(stops ? 1.0 : 4.0, retrace);
    EXPECT_FALSE(output.done);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.5) << "where it arrived";
    EXPECT_NEAR(yaw_of(output.command.o), 3.0, 1e-9);
    if (stops) speed() = 0.0;
    output = tick(retrace);
    EXPECT_TRUE(output.done);
    EXPECT_EQ(output.failed, Failure::kNone);
  }
}

TEST_F(RetraceTest, ArrivesWhereItWasHalfAMetreFromTheEndAndComesNoNearer) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  can_go_up_ = true;
  for (const double x : {-0.98, -0.96, -1.02, -1.0}) {
    p_W().x() = x;
    EXPECT_FALSE(tick(retrace).done) << x;
  }
  EXPECT_TRUE(tick(retrace).done);
}

TEST_F(RetraceTest, WhereItArrivesBelowAnOverheadContinuesFiveTimes) {
  for (const bool is_unknown : {false, true}) {
    settings_.recovery.blocked_trail.wait_s = is_unknown ? 90.0 : 0.0;
    Retrace retrace = without_map();
    for (int arrival = 1; arrival <= 6; ++arrival) {
      estimate_.X_WB = {{3, 0, -4}, from_rpy(arrival == 1 ? 0.0 : 1.0, 0, M_PI)};
      BehaviorOutput output = tick(retrace);
      EXPECT_GT(output.command.v, 0.1) << "it need be level only once";
      EXPECT_NEAR(retrace.progress().distance_to_go_m, 4.5, 1e-9) << "by the trail";
      p_W() = {-1.6, 0, -4};
      output = tick(retrace);
      EXPECT_EQ(output.failed, arrival <= 5 ? Failure::kNone : Failure::kExhausted) << arrival;
    }
  }
}

TEST_F(RetraceTest, WithoutAttitudeItWaitsUntilItCanGoUp) {
  attitude_known_ = false;
  speed() = 0.4;
  Retrace retrace = without_map();
  BehaviorOutput output;
  for (int i = 0; i < 100; ++i) {
    output = after(10.0, retrace);
    EXPECT_EQ(output.command.v, 0.0);
    EXPECT_EQ(output.command.d, 4.0);
    EXPECT_EQ(output.failed, Failure::kNone);
    EXPECT_FALSE(output.done || output.plan_request);
  }
  can_go_up_ = true;
  EXPECT_TRUE(tick(retrace).done) << "moving or not";
}

TEST_F(RetraceTest, TheTimeWithoutAttitudeDoesNotCount) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  attitude_known_ = false;
  EXPECT_EQ(after(1000.0, retrace).command.v, 0.0);
  attitude_known_ = true;
  EXPECT_GT(tick(retrace).command.v, 0.0) << "it goes on";
  EXPECT_GT(after(60.0 + 4.0 * 11.5 / 0.5 - 0.1, retrace).command.v, 0.0);

  attitude_known_ = false;
  can_go_up_ = true;
  EXPECT_TRUE(tick(retrace).done) << "before the trail leads out";
}

TEST_F(RetraceTest, TheTimeToStopDoesNotCountWithoutAttitude) {
  can_go_up_ = true;
  speed() = 0.4;
  Retrace retrace = without_map();
  EXPECT_FALSE(tick(retrace).done);
  can_go_up_ = false;
  attitude_known_ = false;
  EXPECT_FALSE(after(100.0, retrace).done);
  can_go_up_ = true;
  attitude_known_ = true;
  EXPECT_FALSE(after(4.0, retrace).done);
  EXPECT_TRUE(tick(retrace).done);
}

// It must not rise or sink to where it turned back.
TEST_F(RetraceTest, WithoutAttitudeItHoldsTheDepthThatItHas) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  p_W() = {6, 0, -6};
  EXPECT_GT(tick(retrace).command.v, 0.0);
  attitude_known_ = false;
  EXPECT_EQ(tick(retrace).command.d, 6.0);
  p_W().z() = -6.1;
  EXPECT_EQ(tick(retrace).command.d, 6.0) << "and keeps it";
}

TEST_F(RetraceTest, FailsIfItsTrailHasNoOpenWater) {
  for (const bool is_empty : {true, false}) {
    trail_ = Trail();
    if (!is_empty) swim_in({1, 0, -4}, {10, 0, -4});
    Retrace retrace = without_map();
    for (int i = 0; i < 3; ++i) {
      const BehaviorOutput output = tick(retrace);
      EXPECT_EQ(output.failed, Failure::kExhausted);
      EXPECT_FALSE(output.done || output.plan_request);
      EXPECT_EQ(output.command.v, 0.0);
    }
  }
}

TEST_F(RetraceTest, FailsIfItsTrailNoLongerLeadsOutWhereItArrives) {
  Retrace retrace = without_map();
  EXPECT_GT(tick(retrace).command.v, 0.0);
  p_W() = {-1.6, 0, -4};
  EXPECT_EQ(tick(retrace).failed, Failure::kNone);
  trail_ = Trail();
  swim_in({1, 0, -4}, {10, 0, -4});
  EXPECT_EQ(tick(retrace).failed, Failure::kExhausted);
}

}  // namespace
}  // namespace dive::behaviors
