// Failsafes: aborts, exit paths, lost sensors.

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/mission/executive/executive_sample.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

TEST_F(ExecutiveTest, ALeakSurfacesAfterItsPersistence) {
  tick();
  run(3.0, straight_plan());
  leak_ = true;
  run(0.9);
  EXPECT_TRUE(failsafes_.empty());
  run(0.2);
  ASSERT_EQ(failsafes_.size(), 1U);
  EXPECT_EQ(failsafes_[0].rung, "abort_and_surface");
  EXPECT_EQ(failsafes_[0].cause, "leak");
  leak_ = false;  // a sensor that dries again does not cancel the abort
  run(30.0);
  EXPECT_EQ(executive_->result().outcome, Outcome::kAborted);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
  EXPECT_THAT(executive_->result().cause, HasSubstr("water in the hull"));
  EXPECT_LT(depth_, 0.3);
}

TEST_F(ExecutiveTest, OverdepthWarnsAndTheMissionContinues) {
  tick();
  run(1.0, straight_plan());
  depth_ = 8.0;
  EXPECT_EQ(run(1.0).status.rung, "warn");
  ASSERT_FALSE(failsafes_.empty());
  EXPECT_EQ(failsafes_[0].cause, "overdepth");
  run(20.0);
  EXPECT_EQ(failsafes_.back().rung, "none");
  EXPECT_EQ(transitions_.back().to, "first");
}

TEST_F(ExecutiveTest, OvertimeAborts) {
  tick();
  run(3.0, straight_plan());
  for (int hop = 0; hop < 3; ++hop) now_ += from_seconds(35);
  tick();
  EXPECT_EQ(failsafes_.at(0).cause, "mission_timeout");
  EXPECT_EQ(failsafes_.at(0).rung, "abort_and_surface");
}

TEST_F(ExecutiveTest, PlansThatFailInARowAbortWithTheReason) {
  tick();
  for (int answer = 0; answer < 2; ++answer) {
    EXPECT_TRUE(failsafes_.empty());
    run(1.5, no_plan());
  }
  ASSERT_FALSE(failsafes_.empty());
  EXPECT_EQ(failsafes_[0].cause, "planner_failure");
  EXPECT_THAT(executive_->result().cause, HasSubstr("a wall everywhere"));
}

TEST_F(ExecutiveTest, UnderAnOverheadAnAbortRetracesTheTrail) {
  world_ = roofed_world();
  executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  tick();
  run(20.0, straight_plan());  // about 8 m east: under the overhead
  leak_ = true;
  const StepOutputs aborting = run(3.0);
  EXPECT_EQ(aborting.status.state, "dive.abort_retrace");
  EXPECT_NEAR(aborting.command.d, 3.0, 0.2) << "it must not rise into the roof";
  double shallowest_inside = 100.0;
  for (int i = 0; i < 5000 && executive_->result().outcome == Outcome::kRunning; ++i) {
    const StepOutputs outputs = tick();
    if (outputs.estimate.X_WB.p.x() > 0.0) {
      shallowest_inside = std::min(shallowest_inside, outputs.command.d);
    }
  }
  EXPECT_GT(shallowest_inside, 2.5);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
  EXPECT_LT(depth_, 0.3);
}

TEST_F(ExecutiveTest, WithoutAnExitPathItTakesTheLastRung) {
  world_.obstacles.push_back({"roof", planning::Box{{100, 100, 1}}, Pose{{0, 0, -1.5}}});
  executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  tick();
  run(3.0, straight_plan());
  leak_ = true;
  run(6.0);  // it stops first
  ASSERT_EQ(failsafes_.size(), 2U);
  EXPECT_EQ(failsafes_[1].rung, "emergency_surface");
  EXPECT_EQ(failsafes_[1].cause, "retrace_failure");
  EXPECT_EQ(failsafes_[1].competing, "leak");
  EXPECT_EQ(tick().status.state, "dive.emergency");
}

TEST_F(ExecutiveTest, SurfacingUnderAnOverheadBecomesAnAbort) {
  world_ = roofed_world();
  executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  battery_ = 0.4;  // straight from the goal to `ascend`, under the overhead
  tick();
  run(70.0, straight_plan());
  EXPECT_THAT(visited(), ::testing::Contains("dive.abort_retrace"));
  EXPECT_THAT(executive_->result().cause, HasSubstr("ascend was entered under an overhead"));
  EXPECT_EQ(executive_->result().outcome, Outcome::kAborted);
}

TEST_F(ExecutiveTest, AMistakeOfOursEndsInSurfacing) {
  tick();
  run(3.0, straight_plan());
  now_ -= from_seconds(1);  // time runs backwards: a broken invariant
  const StepOutputs outputs = tick();
  ASSERT_EQ(failsafes_.size(), 1U);
  EXPECT_EQ(failsafes_[0].rung, "emergency_surface");
  EXPECT_EQ(failsafes_[0].cause, "internal_error");
  EXPECT_EQ(outputs.command.d, 0.0);
  EXPECT_EQ(outputs.command.v, 0.0);
  obeys_ = false;
  EXPECT_GT(run(2.0).rates.heave, 0.1) << "the autopilot goes on";
  EXPECT_EQ(executive_->result().outcome, Outcome::kRunning) << "until it is at the surface";
  obeys_ = true;
  run(20.0);
  EXPECT_EQ(executive_->result().outcome, Outcome::kAborted);
}

TEST_F(ExecutiveTest, AMistakeOfOursUnderAnOverheadFollowsTheExitPathFirst) {
  world_ = roofed_world();
  executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  tick();
  double x = run(20.0, straight_plan()).estimate.X_WB.p.x();
  ASSERT_GT(x, 3.0);
  ASSERT_FALSE(executive_->exit_path().open_above);
  ASSERT_FALSE(executive_->exit_path().waypoints.empty());
  EXPECT_LT(executive_->exit_path().waypoints.back().p.x(), 0.0) << "in open water";
  now_ -= from_seconds(1);
  for (int i = 0; i < 5000 && executive_->result().outcome == Outcome::kRunning; ++i) {
    const StepOutputs outputs = tick();
    x += outputs.command.v * std::cos(yaw_) * 0.02;
    ASSERT_TRUE(x < 0.5 || outputs.command.d > 2.5) << "under the overhead at " << x;
  }
  EXPECT_EQ(executive_->result().final_state, "dive.internal_error");
  EXPECT_EQ(executive_->result().outcome, Outcome::kAborted);
  EXPECT_LT(depth_, 0.3);
}

TEST_F(ExecutiveTest, WithoutAttitudeInOpenWaterItRises) {
  tick();
  run(5.0, straight_plan());
  imu_speaks_ = false;
  EXPECT_EQ(run(1.0).status.rung, "hold");
  EXPECT_EQ(failsafes_.at(0).cause, "imu_lost");
  run(60.0);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
  EXPECT_LT(depth_, 0.3);
}

TEST_F(ExecutiveTest, WithoutAttitudeUnderAnOverheadItWaitsAndContinuesWhenItIsBack) {
  world_ = roofed_world();
  executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  tick();
  run(15.0, straight_plan());  // under the overhead
  imu_speaks_ = false;
  const StepOutputs waiting = run(20.0);
  EXPECT_EQ(waiting.status.rung, "hold");
  EXPECT_EQ(waiting.command.v, 0.0);
  EXPECT_NEAR(waiting.command.d, 3.0, 0.2) << "it must not rise into the roof";
  EXPECT_EQ(transitions_.back().to, "first") << "it is still on its way";
  imu_speaks_ = true;
  run(5.0);
  EXPECT_EQ(failsafes_.back().rung, "none");
  EXPECT_GT(tick().command.v, 0.2);
}

// A driver that restarts sends nothing for seconds. Half a metre beside the roof nothing is above
// the vehicle, but it may drift under it.
TEST_F(ExecutiveTest, BesideAnOverheadItAwaitsItsSensorsBeforeItAscendsWithoutThem) {
  use("",
      "<hold id=\"first\" duration=\"60\"><transition event=\"done.state.first\" "
      "target=\"ascend\"/></hold>");
  world_.obstacles.push_back({"roof", planning::Box{{40, 40, 1}}, Pose{{16.5, 0, -1.5}}});
  executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  run(2.0);
  imu_speaks_ = depth_speaks_ = false;
  EXPECT_EQ(run(6.0).status.state, "dive.abort_retrace");
  EXPECT_EQ(failsafes_.back().cause, "depth_lost");
  EXPECT_EQ(run(4.0).status.state, "dive.abort_surface");
}

TEST_F(ExecutiveTest, WithoutDepthItComesUpAndTakesItsTime) {
  tick();
  run(5.0, straight_plan());
  depth_speaks_ = false;
  obeys_ = false;
  const StepOutputs rising = run(10.0);
  EXPECT_EQ(failsafes_.at(0).cause, "depth_lost");
  EXPECT_EQ(failsafes_.at(0).why, "no plausible depth for 2 s");
  EXPECT_EQ(rising.status.state, "dive.abort_surface");
  EXPECT_LT(rising.command.d, 0.0) << "up, whatever is believed";
  EXPECT_EQ(executive_->result().outcome, Outcome::kRunning);
  run(40.0);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
}

TEST_F(ExecutiveTest, ARetraceWaitsInOpenWaterBeforeItSurfaces) {
  use("<temperature rung=\"retrace\" above=\"10\" persistence=\"0\"/>",
      "<hold id=\"first\" duration=\"60\"><transition event=\"done.state.first\" "
      "target=\"ascend\"/></hold>");
  run(30.0);  // 20 degrees in the hull
  EXPECT_EQ(failsafes_.at(0).rung, "retrace");
  EXPECT_THAT(visited(), ::testing::ElementsAre("first", "dive.retrace_path", "dive.retrace_wait"));
  run(60.0);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
}

TEST_F(ExecutiveTest, HoldIsTakenBackWhenItsCauseIsGone) {
  use("<overdepth rung=\"hold\" persistence=\"0\" clear=\"1\"/>",
      "<hold id=\"first\" duration=\"20\"><transition event=\"done.state.first\" "
      "target=\"ascend\"/></hold>");
  obeys_ = false;
  run(5.0);
  depth_ = 7.0;
  run(40.0);
  EXPECT_EQ(transitions_.back().to, "first") << "its clock stands still";
  depth_ = 3.0;
  run(14.0);
  EXPECT_EQ(failsafes_.back().rung, "none");
  EXPECT_EQ(transitions_.back().to, "first");
  run(3.0);
  EXPECT_EQ(transitions_.back().to, "ascend");
}

}  // namespace
}  // namespace dive::mission
