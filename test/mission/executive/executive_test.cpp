// The course of a mission: start, restarts, transitions, actions.

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/mission/executive/executive_sample.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

TEST_F(ExecutiveTest, WaitsForSensorsBeforeItStarts) {
  StepInputs blind;
  blind.now = 20'000;
  const StepOutputs outputs = executive_->step(blind);
  EXPECT_TRUE(outputs.transitions.empty());
  EXPECT_EQ(outputs.command.v, 0.0);
  EXPECT_FALSE(outputs.status.finished);
  EXPECT_EQ(tick().transitions.at(0).to, "first");
}

// 0.4 m/s northwards at the start, still water after 3000 s.
std::string with_tide(std::string text) {
  const std::string tide =
      "<current start=\"10:00\"><sample time=\"09:10\" speed=\"0.8\" towards_deg=\"0\"/>"
      "<sample time=\"10:50\" speed=\"0\" towards_deg=\"0\"/></current>";
  text.insert(text.find("<limits"), tide);
  return text;
}

TEST_F(ExecutiveTest, ExpectsTheDeclaredCurrentOfTheMissionsTime) {
  use(with_tide(kMission));
  now_ = 7'000'000'000;  // the clock says nothing of the mission's time
  tick();
  EXPECT_NEAR(executive_->exit_path().current_W.y(), 0.4, 1e-4);
  const StepOutputs outputs = run(30.0);
  EXPECT_NEAR(executive_->exit_path().current_W.y(), 0.4 * (1.0 - 30.0 / 3000.0), 1e-4);
  const Eigen::Vector3d v_W = outputs.estimate.X_WB.q * outputs.estimate.v_WB_B;
  EXPECT_NEAR(v_W.y(), 0.396, 1e-3) << "no plan: it lies in the water";
  EXPECT_NEAR(outputs.estimate.X_WB.p.y(), 0.398 * 30.0, 0.05);
}

TEST_F(ExecutiveTest, ARestartedOneExpectsTheCurrentOfItsCheckpoint) {
  use(with_tide(kMission));
  run(1.0);
  Resume resume;
  resume.checkpoint = executive_->checkpoint();
  resume.checkpoint.elapsed_s = 1500.0;
  resume.checkpoint.X_WB.p = {0.0, 0.0, -3.0};
  resume.checkpoint.v_W = {0.0, 0.2, 0.0};  // carried by the water
  ExecutiveOptions options;
  options.resume = resume;
  executive_.emplace(mission_, world_, model_, options);
  now_ += 10'000'000;
  const StepOutputs outputs = tick();
  EXPECT_NEAR(executive_->exit_path().current_W.y(), 0.4 * (1.0 - 1510.0 / 3000.0), 1e-4);
  EXPECT_NEAR(outputs.estimate.X_WB.p.y(), 0.2 * 10.0, 0.05) << "it was carried meanwhile";
}

// A gap by the clock says little if the clock was set: the vehicle may still move.
TEST_F(ExecutiveTest, ARestartedOneGoesNowhereBeforeTheVehicleIsAtRest) {
  for (const Utime set_by : {-20'000'000, 20'000'000}) {
    use(kMission);
    now_ = 100'000'000;
    run(1.0);
    Resume resume;
    resume.checkpoint = executive_->checkpoint();
    resume.checkpoint.X_WB.p = {0.0, 0.0, -3.0};
    resume.checkpoint.v_W = resume.checkpoint.X_WB.q * Eigen::Vector3d(0.4, 0.0, 0.0);
    ExecutiveOptions options;
    options.resume = resume;
    executive_.emplace(mission_, world_, model_, options);
    now_ += set_by;
    says_ = OperatorCommand::kAbort;
    for (const Utime begin = now_; now_ < begin + 4'900'000;) {
      const StepOutputs held = tick();
      EXPECT_EQ(held.command.v, 0.0);
      EXPECT_NE(held.status.state, "dive.abort_surface") << set_by << " at " << now_ - begin;
    }
    EXPECT_EQ(run(1.0).status.state, "dive.abort_surface") << set_by;
  }
}

TEST_F(ExecutiveTest, KeepsTheBiasesOfTheImuOverRestarts) {
  run(1.0);
  EXPECT_FALSE(executive_->checkpoint().imu_bias);
  executive_->keep_imu_bias({now_, {0.05, -0.02, 0.01}, {0.1, 0.2, -0.1}, 0.001, 0.03});
  for (int restart = 0; restart < 2; ++restart) {
    Resume resume;
    resume.checkpoint = executive_->checkpoint();
    ExecutiveOptions options;
    options.resume = resume;
    executive_.emplace(mission_, world_, model_, options);
    run(0.1);
    ASSERT_TRUE(executive_->checkpoint().imu_bias);
    EXPECT_EQ(executive_->checkpoint().imu_bias->gyro_B, Eigen::Vector3d(0.05, -0.02, 0.01));
  }
}

TEST_F(ExecutiveTest, SwimsTheNominalMission) {
  tick();
  ASSERT_TRUE(query_);
  EXPECT_EQ(query_->state, "first");
  const StepOutputs swimming = run(5.0, straight_plan());
  EXPECT_EQ(swimming.status.state, "first");
  EXPECT_GT(swimming.command.v, 0.3);
  EXPECT_NEAR(swimming.status.clearance_m, 0.9, 1e-12);
  EXPECT_GT(swimming.rates.surge, 0.0);
  run(60.0);
  EXPECT_EQ(visited(), (std::vector<std::string>{"first", "rest", "ascend", "surfaced"}));
  EXPECT_EQ(executive_->result().outcome, Outcome::kSuccess);
  EXPECT_EQ(executive_->result().final_state, "surfaced");
  EXPECT_EQ(executive_->result().cause, "");
  EXPECT_LT(depth_, 0.3);
  EXPECT_TRUE(failsafes_.empty());
}

TEST_F(ExecutiveTest, GuardsChooseTheTransition) {
  battery_ = 0.4;
  tick();
  run(60.0, straight_plan());
  EXPECT_EQ(visited(), (std::vector<std::string>{"first", "ascend", "surfaced"}));
}

TEST_F(ExecutiveTest, ATimeoutIsNeverASuccess) {
  std::string patient = kMission;
  patient.replace(patient.find("failures=\"2\""), 12, "failures=\"9\"");
  use(patient);
  tick();  // the planner never answers
  run(39.0);
  EXPECT_EQ(transitions_.back().to, "first");
  run(30.0);
  EXPECT_EQ(visited(), (std::vector<std::string>{"first", "ascend", "surfaced"}));
  EXPECT_EQ(executive_->result().outcome, Outcome::kAborted);
  EXPECT_THAT(executive_->result().cause, HasSubstr("first took longer than 40 s"));
}

TEST_F(ExecutiveTest, AnswersToOldQuestionsAreIgnored) {
  tick();
  PlanReply stale = straight_plan();
  stale.id += 17;
  EXPECT_EQ(run(1.0, stale).command.v, 0.0);
}

TEST_F(ExecutiveTest, AfterAStallTheVehicleIsExpectedToHaveStopped) {
  tick();
  const double before = run(10.0, straight_plan()).estimate.X_WB.p.x();
  now_ += from_seconds(5.0);
  const double after = tick().estimate.X_WB.p.x();
  EXPECT_GT(after, before);
  EXPECT_LT(after - before, 0.8) << "commands expire after 0.2 s";
  EXPECT_THAT(actions_.back().text, HasSubstr("no tick for 5.0 s"));
  for (int i = 0; i < 45; ++i) EXPECT_EQ(tick().command.v, 0.0) << "the supervisor still holds it";
  EXPECT_GT(run(2.0).command.v, 0.1);
}

TEST_F(ExecutiveTest, TransitionsSayWhichGuardsDecidedAndWithWhatValues) {
  tick();
  run(60.0, straight_plan());
  ASSERT_GE(transitions_.size(), 2U);
  EXPECT_EQ(transitions_[1].guards, "battery_fraction > 0.5: true (battery_fraction 1.00)");
}

TEST_F(ExecutiveTest, AnEventThatLeadsNowhereIsNoted) {
  use("",
      "<goto id=\"first\" x=\"6\" y=\"0\" z=\"3\" z_units=\"DEPTH\" timeout=\"40\" "
      "on_timeout=\"ascend\"><transition event=\"done.state.first\" cond=\"depth &gt; 9 m\" "
      "target=\"ascend\"/></goto>");
  tick();
  run(45.0, straight_plan());
  ASSERT_FALSE(actions_.empty());
  EXPECT_EQ(actions_[0].kind, ActionRecord::Kind::kNote);
  EXPECT_THAT(actions_[0].text,
              HasSubstr("done.state.first: no transition taken: depth > 9 m: false (depth 3.0"));
  EXPECT_EQ(transitions_.back().event, "timeout.first");
}

TEST_F(ExecutiveTest, ActionsAreDoneInTheirOrderAndOnceMeansOnce) {
  use("",
      "<hold id=\"first\" duration=\"1\"><onentry><log message=\"in\"/><payload "
      "command=\"lights\" once=\"true\"/><payload command=\"photo\"/></onentry><onexit><log "
      "message=\"out\"/></onexit><transition event=\"done.state.first\" cond=\"elapsed &lt; "
      "1.5 s\" target=\"first\"><log message=\"again\"/><raise event=\"round\"/></transition>"
      "<transition event=\"round\"><log message=\"heard\"/></transition>"
      "<transition event=\"done.state.first\" target=\"ascend\"/></hold>");
  run(3.0);
  std::vector<std::string> said;
  for (const ActionRecord& action : actions_) {
    if (action.kind != ActionRecord::Kind::kNote) said.push_back(action.text);
  }
  EXPECT_EQ(said, (std::vector<std::string>{"in", "lights", "photo", "out", "again", "in", "photo",
                                            "heard", "out"}));
}

// A wreck from x = 0 on: it turns back at its maximum penetration.
TEST_F(ExecutiveTest, APenetrationTurnsBackWhenItIsDeepEnough) {
  world_ = roofed_world();
  use("",
      "<wreck_penetration id=\"first\" max_penetration=\"4\" timeout=\"90\" "
      "on_timeout=\"ascend\"><entry x=\"-3\" y=\"0\" z=\"3\" z_units=\"DEPTH\"/><goal "
      "id=\"deep\" x=\"15\" y=\"0\" z=\"3\" z_units=\"DEPTH\"/><transition "
      "event=\"done.state.first plan.failed.first\" target=\"ascend\"/></wreck_penetration>");
  double deepest = -10.0;
  for (int i = 0; i < 6000 && executive_->result().outcome == Outcome::kRunning; ++i) {
    const bool asked = query_.has_value();
    const std::optional<PlanReply> reply = asked ? std::optional(straight_plan()) : std::nullopt;
    query_.reset();
    deepest = std::max(deepest, tick(reply).estimate.X_WB.p.x());
  }
  EXPECT_EQ(executive_->result().outcome, Outcome::kSuccess) << executive_->result().cause;
  EXPECT_THAT(visited(), ::testing::ElementsAre("first-entry", "first-inside", "first-exit",
                                                "first-out", "ascend", "surfaced"));
  EXPECT_GT(deepest, 2.5);
  EXPECT_LT(deepest, 5.5);
  EXPECT_THAT(transitions_[2].guards, HasSubstr("penetration > 4 m or budget_used > 0.3333: true"));
}

}  // namespace
}  // namespace dive::mission
