// The executive fed by hand: no simulator, no planner; every input is written here.

#include "mission/executive/executive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="test">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map file="none.sdf"/>
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

// A roof over x > 0, from 1 m to 2 m depth.
planning::World roofed_world() {
  planning::World world;
  world.obstacles.push_back({"roof", planning::Box{{40, 40, 1}}, Pose{{20, 0, -1.5}}});
  return world;
}

class ExecutiveTest : public ::testing::Test {
 protected:
  void SetUp() override {
    Diagnostics diagnostics;
    std::optional<Mission> mission =
        parse_mission(SourceText("test.xml", kMission), diagnostics, MapFile::kNotNeeded);
    ASSERT_TRUE(mission) << render(diagnostics.list().at(0), false);
    mission_ = std::move(*mission);
    model_ = *vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
    executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  }

  // One tick with all sensors at the true state.
  StepOutputs tick(const std::optional<PlanReply>& plan = {}) {
    now_ += 20'000;
    StepInputs inputs;
    inputs.now = now_;
    ImuSample imu;
    imu.utime = now_;
    noise_ = -noise_;  // a sensor that works is never quite still
    imu.q_WB = from_rpy(0, 0, yaw_ + noise_);
    imu.accel_B.z() = 9.81;
    inputs.imu = imu;
    inputs.depth = DepthSample{now_, depth_ + noise_};
    inputs.health = HealthSample{now_, battery_, 20.0, leak_};
    inputs.plan = plan;
    StepOutputs outputs = executive_->step(inputs);
    if (outputs.plan_query) query_ = outputs.plan_query;
    for (const TransitionRecord& record : outputs.transitions) transitions_.push_back(record);
    for (const FailsafeRecord& record : outputs.failsafes) failsafes_.push_back(record);
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
    reply.status = planning::PlanStatus::kSuccess;
    reply.waypoints = {query_->request.start, query_->request.goal};
    reply.clearance_m = 0.9;
    return reply;
  }

  [[nodiscard]] PlanReply no_plan() const {
    PlanReply reply;
    reply.id = query_->id;
    reply.status = planning::PlanStatus::kNoPath;
    reply.reason = "a wall everywhere";
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
  leak_ = false;  // a sensor that dried again does not take the abort back
  run(30.0);
  EXPECT_EQ(executive_->result().outcome, Outcome::kAborted);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
  EXPECT_THAT(executive_->result().cause, HasSubstr("water in the hull"));
  EXPECT_LT(depth_, 0.3);
}

TEST_F(ExecutiveTest, OverdepthWarnsAndTheMissionGoesOn) {
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
  EXPECT_EQ(failsafes_.at(0).cause, "overtime");
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

TEST_F(ExecutiveTest, UnderARoofAnAbortGoesBackAlongTheTrail) {
  world_ = roofed_world();
  executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  tick();
  run(20.0, straight_plan());  // about 8 m east: under the roof
  leak_ = true;
  const StepOutputs aborting = run(3.0);
  EXPECT_EQ(aborting.status.state, "dive.retrace");
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

TEST_F(ExecutiveTest, WithoutAWayOutItTakesTheLastRung) {
  world_.obstacles.push_back({"roof", planning::Box{{100, 100, 1}}, Pose{{0, 0, -1.5}}});
  executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  tick();
  run(3.0, straight_plan());
  leak_ = true;
  run(2.0);
  ASSERT_EQ(failsafes_.size(), 2U);
  EXPECT_EQ(failsafes_[1].rung, "emergency_surface");
  EXPECT_EQ(failsafes_[1].cause, "retrace_failure");
  EXPECT_EQ(failsafes_[1].competing, "leak");
  EXPECT_EQ(tick().status.state, "dive.emergency");
}

TEST_F(ExecutiveTest, SurfacingUnderARoofBecomesAnAbort) {
  world_ = roofed_world();
  executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  battery_ = 0.4;  // straight from the goal to `ascend`, under the roof
  tick();
  run(60.0, straight_plan());
  EXPECT_THAT(visited(), ::testing::Contains("dive.retrace"));
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
  EXPECT_EQ(executive_->result().outcome, Outcome::kAborted);
}

}  // namespace
}  // namespace dive::mission
