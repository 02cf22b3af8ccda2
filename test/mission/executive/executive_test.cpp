// The executive with synthetic inputs: no simulator, no planner; every input is written here.

#include "mission/executive/executive.h"

#include <algorithm>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/executive/map_updates.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="test">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map file="none.sdf" fixes="off"/>
  <start x="-4" y="0" z="3" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="6" min_altitude="0.3" clearance="0.6" mission_timeout="100"
          battery_reserve="0.2"/>
  <failsafes>
    <leak rung="abort_and_surface" persistence="1"/>
    <overdepth rung="warn" persistence="0.2"/>
    <planner_failure rung="abort_and_surface" failures="2"/>
  </failsafes>
  <states initial="first">
    <goto id="first" x="6" y="0" z="3" z_units="DEPTH" capture_radius="0.5" timeout="40"
          on_timeout="ascend">
      <transition event="done.state.first" cond="battery_fraction &gt; 0.5" target="rest"/>
      <transition event="done.state.first" target="ascend"/>
    </goto>
    <hold id="rest" duration="2">
      <transition event="done.state.rest" target="ascend"/>
    </hold>
    <surface id="ascend">
      <transition event="done.state.ascend" target="surfaced"/>
    </surface>
    <final id="surfaced"/>
  </states>
</mission>)";

// An overhead over x > 0, from 1 m to 2 m depth.
planning::World roofed_world() {
  planning::World world;
  world.obstacles.push_back({"roof", planning::Box{{40, 40, 1}}, Pose{{20, 0, -1.5}}});
  return world;
}

// With edges of 1 m.
planning::Polytope cube_at(const Eigen::Vector3d& centre_W) {
  planning::Polytope cube;
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      for (const double z : {-0.5, 0.5})
        cube.vertices.push_back(centre_W + Eigen::Vector3d(x, y, z));
    }
  }
  return cube;
}

class ExecutiveTest : public ::testing::Test {
 protected:
  void SetUp() override {
    Diagnostics diagnostics;
    model_ = *vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
    use(kMission);
  }

  void use(const std::string& text) {
    Diagnostics diagnostics;
    std::optional<Mission> mission =
        parse_mission(SourceText("test.xml", text), diagnostics, MapFile::kNotNeeded);
    ASSERT_TRUE(mission) << render(diagnostics.list().at(0), false);
    mission_ = std::move(*mission);
    executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  }

  // kMission with other failsafes and states; `states` end in <surface id="ascend"/>.
  void use(const std::string& failsafes, const std::string& states) {
    std::string text = kMission;
    const std::size_t f = text.find("<failsafes>");
    text.replace(f, text.find("</failsafes>") - f, "<failsafes>" + failsafes);
    const std::size_t s = text.find("<goto");
    text.replace(s, text.find("<surface") - s, states);
    use(text);
  }

  // One tick with all sensors at the true state.
  StepOutputs tick(const std::optional<PlanReply>& plan = {}) {
    now_ += 20'000;
    StepInputs inputs;
    inputs.now = now_;
    ImuSample imu;
    imu.utime = now_;
    noise_ = -noise_;  // a working sensor is never quite constant
    imu.q_WB = from_rpy(0, 0, yaw_ + noise_);
    imu.accel_B.z() = 9.81;
    if (imu_speaks_) inputs.imu = imu;
    inputs.operator_command = std::exchange(says_, std::nullopt);
    if (!appears_.empty()) {
      inputs.obstacles.push_back(
          {planning::ObstacleSource::kScript, now_, std::exchange(appears_, {})});
    }
    inputs.loss = std::exchange(loss_, std::nullopt);
    inputs.obstacle_ahead = std::exchange(ahead_, std::nullopt);
    if (depth_speaks_) inputs.depth = DepthSample{now_, depth_ + noise_};
    inputs.health = HealthSample{now_, battery_, 20.0, leak_};
    inputs.plan = plan;
    update_map(map_, inputs);
    StepOutputs outputs = executive_->step(inputs);
    if (outputs.plan_query) query_ = outputs.plan_query;
    for (const TransitionRecord& record : outputs.transitions) transitions_.push_back(record);
    for (const FailsafeRecord& record : outputs.failsafes) failsafes_.push_back(record);
    for (const ActionRecord& record : outputs.actions) actions_.push_back(record);
    if (obeys_) depth_ += std::clamp(outputs.command.d - depth_, -0.01, 0.01);  // at 0.5 m/s
    yaw_ = to_rpy(outputs.command.o).z();
    return outputs;
  }

  StepOutputs run(double seconds, const std::optional<PlanReply>& plan = {}) {
    StepOutputs outputs = tick(plan);
    for (const Utime end = now_ + from_seconds(seconds); now_ < end;) outputs = tick();
    return outputs;
  }

  [[nodiscard]] PlanReply straight_plan() const {
    PlanReply reply;
    reply.id = query_->id;
    reply.plan.status = planning::PlanStatus::kSuccess;
    reply.plan.accepted = true;
    reply.plan.waypoints = {query_->request.start, query_->request.goal};
    reply.plan.clearance_m = 0.9;
    return reply;
  }

  [[nodiscard]] PlanReply no_plan() const {
    PlanReply reply;
    reply.id = query_->id;
    reply.plan.status = planning::PlanStatus::kNoPath;
    reply.plan.reason = "a wall everywhere";
    return reply;
  }

  [[nodiscard]] std::vector<std::string> visited() const {
    std::vector<std::string> states;
    for (const TransitionRecord& record : transitions_) states.push_back(record.to);
    return states;
  }

  Mission mission_;
  planning::World world_;
  vehicle::Model model_;
  std::optional<Executive> executive_;
  Utime now_ = 0;
  double depth_ = 3.0;
  double yaw_ = 0.0;
  double noise_ = 1e-4;
  double battery_ = 1.0;
  bool leak_ = false;
  bool obeys_ = true;
  std::optional<PlanQuery> query_;
  std::vector<TransitionRecord> transitions_;
  std::vector<FailsafeRecord> failsafes_;
  std::vector<ActionRecord> actions_;
  bool imu_speaks_ = true;
  bool depth_speaks_ = true;
  std::optional<OperatorCommand> says_;
  std::optional<RecordingLoss> loss_;
  std::optional<planning::ObstacleAhead> ahead_;
  std::vector<planning::MapCell> appears_;
  planning::ObservedMap map_;
};

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
              HasSubstr("done.state.first leads nowhere: depth > 9 m: false (depth 3.0"));
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
  EXPECT_EQ(transitions_.back().cause, "topside says skip");
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

TEST_F(ExecutiveTest, SomethingInThePathIsSeenAndPlannedAround) {
  tick();
  run(3.0, straight_plan());
  query_.reset();
  appears_ = {{-1, {cube_at({3, 0, -3})}}};
  const StepOutputs outputs = tick();
  ASSERT_TRUE(query_);
  EXPECT_EQ(query_->cause, "the path is blocked or has ended");
  EXPECT_LE(outputs.command.v, 0.0) << "what leads into it is not followed";
  const PlanReply through = straight_plan();  // planned before it was observed
  EXPECT_LE(run(1.5, through).command.v, 0.0) << "and not taken";
}

// Raised once for each path: not for an obstacle beside it, nor again for the same path.
TEST_F(ExecutiveTest, AnObstacleInThePathIsAnEventAndOneBesideItIsNot) {
  use("", R"(<goto id="first" x="6" y="0" z="3" z_units="DEPTH" timeout="60" on_timeout="ascend">
               <transition event="map.changed"><log message="map changed"/></transition>
               <transition event="done.state.first" target="ascend"/>
             </goto>)");
  tick();
  run(1.0, straight_plan());
  const auto events = [&] {
    return std::ranges::count(actions_, std::string("map changed"), &ActionRecord::text);
  };
  appears_ = {{-1, {cube_at({3, 5, -3})}}};
  run(1.0);
  EXPECT_EQ(events(), 0);
  appears_ = {{-2, {cube_at({4, 0.9, -3})}}};
  run(1.0);
  EXPECT_EQ(events(), 1);
  appears_ = {{-3, {cube_at({4, -0.9, -3})}}};
  run(1.0);
  EXPECT_EQ(events(), 1) << "the same path is still followed";
}

TEST_F(ExecutiveTest, StopsForAnObstacleThatAScanShowsInItsWay) {
  tick();
  EXPECT_GT(run(3.0, straight_plan()).command.v, 0.3);
  query_.reset();
  actions_.clear();
  ahead_ = planning::ObstacleAhead{now_, 0.9, {0.7, 0.0, 0.0}};
  const StepOutputs outputs = tick();
  EXPECT_LE(outputs.command.v, 0.0) << "it brakes";
  EXPECT_FALSE(outputs.plan_query) << "the map does not have it yet";
  ASSERT_EQ(actions_.size(), 1u);
  EXPECT_THAT(actions_.front().text, HasSubstr("reaches an obstacle in 0.9 s"));
  for (int i = 0; i < 55; ++i) EXPECT_LE(tick().command.v, 0.0);
  run(0.5);
  ASSERT_TRUE(query_);
  EXPECT_GT(run(3.0, straight_plan()).command.v, 0.3) << "nothing is in the way any more";
}

// Against a current it swims back to its place while it rises.
TEST_F(ExecutiveTest, WhatAScanShowsDoesNotStopAnAscent) {
  std::string text = kMission;
  text.insert(text.find("<limits"), R"(<current speed="0.08" towards_deg="90" sigma="0.01"/>)");
  use(text);
  tick();
  says_ = OperatorCommand::kAbort;
  StepOutputs outputs = tick();
  while (outputs.command.v <= 0.0 && depth_ > 0.5) outputs = tick();
  ASSERT_GT(outputs.command.v, 0.0);
  ASSERT_EQ(outputs.status.state, "dive.abort_surface");
  const double depth = outputs.command.d;
  ahead_ = planning::ObstacleAhead{now_, 0.9, {0.7, 0.0, 0.0}};
  EXPECT_EQ(tick().command.v, 0.0);
  outputs = run(0.9);
  EXPECT_EQ(outputs.command.v, 0.0);
  EXPECT_NEAR(outputs.command.d, depth - 0.92 * 0.25, 0.01);
}

TEST_F(ExecutiveTest, AnObstacleOfAnOldScanOrOfNoPlaceIsIgnored) {
  tick();
  run(1.0, straight_plan());
  ahead_ = planning::ObstacleAhead{now_ + from_seconds(100), 0.9, {0.7, 0.0, 0.0}};
  EXPECT_GT(tick().command.v, 0.3) << "of the future";
  ahead_ = planning::ObstacleAhead{now_, 0.9, {std::nan(""), 0.0, 0.0}};
  EXPECT_GT(tick().command.v, 0.3);
  const Utime seen = now_;
  ahead_ = planning::ObstacleAhead{seen, 0.9, {0.7, 0.0, 0.0}};
  EXPECT_LE(tick().command.v, 0.0);
  run(2.0);
  EXPECT_GT(run(3.0, straight_plan()).command.v, 0.3);
  ahead_ = planning::ObstacleAhead{seen, 0.9, {0.7, 0.0, 0.0}};
  EXPECT_GT(tick().command.v, 0.3) << "once is enough";
}

TEST_F(ExecutiveTest, AnUpdateOfTheFutureOrTwiceTheSameChangesNothing) {
  StepInputs inputs;
  inputs.now = from_seconds(1.0);
  inputs.obstacles = {{planning::ObstacleSource::kMapper, from_seconds(1.2), {{1, {}}}},
                      {planning::ObstacleSource::kScript, from_seconds(1.0), {{-1, {}}}},
                      {planning::ObstacleSource::kScript, from_seconds(1.0), {{-2, {}}}}};
  update_map(map_, inputs);
  EXPECT_EQ(map_.revision(), 1);
  EXPECT_EQ(inputs.observed_map.revision(), 1);
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
