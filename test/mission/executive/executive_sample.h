#pragma once
// The executive with synthetic inputs: no simulator, no planner; every input is written here.

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "mission/executive/executive.h"
#include "mission/executive/map_updates.h"

namespace dive::mission {

inline constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="test">
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
inline planning::World roofed_world() {
  planning::World world;
  world.obstacles.push_back({"roof", planning::Box{{40, 40, 1}}, Pose{{20, 0, -1.5}}});
  return world;
}

// With edges of 1 m.
inline planning::Polytope cube_at(const Eigen::Vector3d& centre_W) {
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

}  // namespace dive::mission
