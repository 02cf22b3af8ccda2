// Topside and the log: pause, skip, abort, losses of the recording.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/mission/executive/executive_sample.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

TEST_F(ExecutiveTest, PauseHoldsAndTheStatesClockStandsStill) {
  tick();
  run(5.0, straight_plan());
  says_ = OperatorCommand::kPause;
  const double d = run(60.0).command.d;  // longer than the state's timeout
  EXPECT_EQ(transitions_.back().to, "first");
  EXPECT_EQ(run(1.0).command.v, 0.0);
  EXPECT_NEAR(d, 3.0, 0.1);
  says_ = OperatorCommand::kResume;
  EXPECT_GT(run(2.0).command.v, 0.2) << "on along the path it had";
}

TEST_F(ExecutiveTest, NoPauseKeepsALeakingVehicleDown) {
  tick();
  says_ = OperatorCommand::kPause;
  run(2.0);
  leak_ = true;
  run(40.0);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
}

TEST_F(ExecutiveTest, SkipContinuesAsIfItWereDone) {
  tick();
  run(1.0, straight_plan());
  says_ = OperatorCommand::kSkip;
  tick();
  EXPECT_EQ(transitions_.back().to, "rest");
  EXPECT_EQ(transitions_.back().cause, "topside commanded skip");
}

TEST_F(ExecutiveTest, TopsideAborts) {
  tick();
  says_ = OperatorCommand::kAbort;
  tick();
  EXPECT_EQ(failsafes_.at(0).cause, "operator_abort");
  run(30.0);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
}

TEST_F(ExecutiveTest, ASignalAbortsAndTheCauseNamesIt) {
  for (const auto& [command, name] : {std::pair{OperatorCommand::kSigterm, "SIGTERM"},
                                      std::pair{OperatorCommand::kSigint, "SIGINT"}}) {
    use(kMission);
    failsafes_.clear();
    now_ = 0;
    depth_ = 3.0;
    tick();
    says_ = command;
    tick();
    EXPECT_EQ(failsafes_.at(0).cause, "operator_abort");
    EXPECT_THAT(failsafes_.at(0).why, HasSubstr(name));
    run(30.0);
    EXPECT_EQ(executive_->result().final_state, "dive.aborted");
    EXPECT_THAT(executive_->result().cause, HasSubstr(name));
  }
}

TEST_F(ExecutiveTest, ALossOfTheLogWarnsAndIsNotedWhenItIsOver) {
  tick();
  loss_ = RecordingLoss{3, 1, 1};
  const StepOutputs lost = tick();
  ASSERT_EQ(failsafes_.size(), 1U);
  EXPECT_EQ(failsafes_.at(0).rung, "warn");
  EXPECT_EQ(failsafes_.at(0).cause, "log_lost");
  EXPECT_EQ(failsafes_.at(0).why, "3 ticks of the log and 1 commits of the journal are lost");
  ASSERT_EQ(lost.actions.size(), 1U);
  EXPECT_THAT(lost.actions[0].text, HasSubstr("1 payload commands were not sent"));
  std::vector<std::string> notes;
  for (int i = 0; i < 60; ++i) {
    for (const ActionRecord& action : tick().actions) notes.push_back(action.text);
  }
  EXPECT_EQ(notes, std::vector<std::string>{failsafes_.at(0).why});
  run(6.0, straight_plan());
  EXPECT_EQ(failsafes_.back().rung, "none");
}

TEST_F(ExecutiveTest, AMissionMayEndADiveWithoutALog) {
  use("<log_lost rung=\"abort_and_surface\"/>",
      "<hold id=\"first\" duration=\"50\"><transition event=\"done.state.first\" "
      "target=\"ascend\"/>"
      "</hold>");
  tick();
  loss_ = RecordingLoss{1, 0, 0};
  run(30.0);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
  EXPECT_THAT(executive_->result().cause, HasSubstr("log_lost"));
}

TEST_F(ExecutiveTest, ASilentTopsideCountsOnlyWhereItIsWatched) {
  tick();
  run(35.0, straight_plan());
  EXPECT_TRUE(failsafes_.empty());
  use("<comms_lost rung=\"abort_and_surface\" after=\"10\"/>",
      "<hold id=\"first\" duration=\"60\"><transition event=\"done.state.first\" "
      "target=\"ascend\"/></hold>");
  for (int i = 0; i < 4; ++i) {
    says_ = OperatorCommand::kHeartbeat;
    run(8.0);
  }
  EXPECT_TRUE(failsafes_.empty());
  run(3.0);
  EXPECT_EQ(failsafes_.at(0).cause, "comms_lost");
}

}  // namespace
}  // namespace dive::mission
