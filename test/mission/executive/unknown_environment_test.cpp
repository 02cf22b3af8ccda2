// The executive in an unknown environment, with synthetic observations.

#include <stdexcept>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/document/state_index.h"
#include "mission/executive/behavior_factory.h"
#include "mission/executive/executive.h"
#include "mission/executive/map_updates.h"
#include "mission/onboard/planner_service.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

// From x = -4 to x = 16 along y = 0, 3 m deep; OVERHEAD, POLICY and FAILSAFES are filled in.
constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="test">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map unknown="POLICY"/>
  <start x="-4" y="0" z="3" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="6" min_altitude="0.3" clearance="0.6" mission_timeout="400"
          battery_reserve="0.2"/>
  <states initial="gate">
    <goto id="gate" x="-1" y="0" z="3" z_units="DEPTH" timeout="300" on_timeout="ascend">
      <transition event="done.state.gate" target="in"/>
    </goto>
    <goto id="in" x="16" y="0" z="3" z_units="DEPTH" timeout="300" on_timeout="back" OVERHEAD>
      <transition event="done.state.in plan.failed.in" target="back"/>
    </goto>
    <retrace id="back">
      <transition event="done.state.back" target="ascend"/>
    </retrace>
    <surface id="ascend">
      <transition event="done.state.ascend" target="surfaced"/>
    </surface>
    <final id="surfaced"/>
  </states>
</mission>)";

planning::Polytope block(const Eigen::Vector3d& centre, double edge) {
  planning::Polytope piece;
  for (unsigned i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner((i & 1U) ? 0.5 : -0.5, (i & 2U) ? 0.5 : -0.5,
                                 (i & 4U) ? 0.5 : -0.5);
    piece.vertices.push_back(centre + edge * corner);
  }
  return piece;
}

class UnknownWater : public ::testing::Test {
 protected:
  void SetUp() override { use("cautious", ""); }

  void use(const std::string& policy, const std::string& overhead, const std::string& limit = "") {
    std::string text = kMission;
    text.replace(text.find("POLICY"), 6, policy);
    text.replace(text.find("OVERHEAD"), 8, overhead);
    text.insert(text.find("min_altitude"), limit);
    Diagnostics diagnostics;
    model_ = *vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
    std::optional<Mission> mission =
        parse_mission(SourceText("test.xml", text), diagnostics, MapFile::kNotNeeded);
    ASSERT_TRUE(mission) << render(diagnostics.list().at(0), false);
    mission_ = std::move(*mission);
    executive_.emplace(mission_, nothing_, model_, ExecutiveOptions{});
    map_ = {};
  }

  // One tick; the vehicle follows depth and heading commands, and swims at the expected speed.
  StepOutputs tick(const std::optional<PlanReply>& plan = {}) {
    now_ += 20'000;
    noise_ = -noise_;
    StepInputs inputs;
    inputs.now = now_;
    inputs.imu.emplace().utime = now_;
    inputs.imu->q_WB = from_rpy(0, 0, yaw_ + noise_);
    inputs.imu->accel_B.z() = 9.81;
    inputs.depth = DepthSample{now_, depth_ + noise_};
    inputs.health = HealthSample{now_, 1.0, 20.0, leak_};
    inputs.plan = plan;
    if (sees_) {
      const Utime scan_utime = now_ - 40'000;
      inputs.obstacles.push_back(
          {planning::ObstacleSource::kMapper, scan_utime, std::exchange(appears_, {})});
      inputs.free_ahead = planning::FreeAhead{scan_utime, seen_ahead_};
    }
    update_map(map_, inputs);
    StepOutputs outputs = executive_->step(inputs);
    if (outputs.plan_query) query_ = outputs.plan_query;
    for (const TransitionRecord& record : outputs.transitions) visited_.push_back(record.to);
    for (const FailsafeRecord& record : outputs.failsafes) failsafes_.push_back(record);
    depth_ += std::clamp(outputs.command.d - depth_, -0.01, 0.01);
    yaw_ = to_rpy(outputs.command.o).z();
    return outputs;
  }
  // Every plan request is answered by the straight path, a tick later.
  StepOutputs swim(double seconds) {
    StepOutputs outputs;
    for (const Utime end = now_ + from_seconds(seconds); now_ < end;) {
      const std::optional<PlanQuery> asked = std::exchange(query_, std::nullopt);
      outputs = asked ? tick(straight(*asked)) : tick();
    }
    return outputs;
  }
  StepOutputs run(double seconds) {
    StepOutputs outputs;
    for (const Utime end = now_ + from_seconds(seconds); now_ < end;) outputs = tick();
    return outputs;
  }
  [[nodiscard]] static PlanReply straight(const PlanQuery& query) {
    PlanReply reply;
    reply.id = query.id;
    reply.plan.status = planning::PlanStatus::kSuccess;
    reply.plan.accepted = true;
    reply.plan.waypoints = {query.request.start, query.request.goal};
    reply.plan.clearance_m = 5.0;
    return reply;
  }
  void appears(planning::CellKey cell, const Eigen::Vector3d& centre, double edge) {
    appears_ = {{cell, {block(centre, edge)}}};
  }
  void vanishes(planning::CellKey cell) { appears_ = {{cell, {}}}; }

  Mission mission_;
  planning::World nothing_;
  vehicle::Model model_;
  std::optional<Executive> executive_;
  Utime now_ = 0;
  double depth_ = 3.0;
  double yaw_ = 0.0;
  double noise_ = 1e-4;
  bool leak_ = false;
  bool sees_ = true;
  double seen_ahead_ = 5.0;
  std::vector<planning::MapCell> appears_;
  planning::ObservedMap map_;
  std::optional<PlanQuery> query_;
  std::vector<std::string> visited_;
  std::vector<FailsafeRecord> failsafes_;
};

TEST_F(UnknownWater, ACautiousVehicleStopsWithinObservedSpace) {
  sees_ = false;
  EXPECT_EQ(swim(1.0).command.v, 0.0) << "it waits for range data";
  sees_ = true;
  EXPECT_GT(swim(3.0).command.v, 0.35);
  seen_ahead_ = 0.49;
  const double v = swim(1.0).command.v;
  EXPECT_LT(v, 0.25);
  EXPECT_GT(v, 0.15);
  seen_ahead_ = 0.1;
  EXPECT_LE(swim(0.1).command.v, 0.0) << "it brakes";
  seen_ahead_ = 5.0;
  EXPECT_GT(swim(1.0).command.v, 0.35);
  EXPECT_TRUE(failsafes_.empty());
}

TEST_F(UnknownWater, WhereItCannotObserveItDoesNotWaitForEver) {
  swim(30.0);
  ASSERT_EQ(visited_.back(), "in");
  // It creeps along the edge of the observed space and makes no progress.
  for (int i = 0; i < 240 && visited_.back() == "in"; ++i) {
    seen_ahead_ = i % 2 == 0 ? 0.0 : 0.3;
    swim(0.1);
  }
  EXPECT_THAT(visited_, ::testing::Contains("back"));
}

TEST_F(UnknownWater, AnOptimisticVehicleContinues) {
  use("optimistic", "");
  seen_ahead_ = 0.0;
  EXPECT_GT(swim(3.0).command.v, 0.35);
  sees_ = false;
  EXPECT_GT(swim(1.8).command.v, 0.35);
}

TEST_F(UnknownWater, WhatAppearsBesideThePathIsPlannedRoundAndInThePathIsStoppedAt) {
  swim(30.0);
  ASSERT_EQ(visited_.back(), "in");
  EXPECT_EQ(tick().status.clearance_m, 5.0);

  appears(1, {14, 0.8, -3}, 0.6);  // between 0.1 and 0.6 m from the hull's path
  StepOutputs outputs = tick();
  ASSERT_TRUE(outputs.plan_query);
  EXPECT_EQ(outputs.plan_query->cause, "map changed");
  EXPECT_GT(outputs.command.v, 0.35) << "on along the old path while it is planned";
  EXPECT_LT(outputs.status.clearance_m, 0.6);
  EXPECT_GT(outputs.status.clearance_m, 0.0);

  // Two answers planned before it was observed: requested again at once, while it still swims.
  for (int i = 0; i < 2; ++i) {
    outputs = tick(straight(*query_));
    ASSERT_TRUE(outputs.plan_query);
    EXPECT_EQ(outputs.plan_query->cause, "the map changed during planning");
    EXPECT_GT(outputs.command.v, 0.35);
  }

  vanishes(1);
  tick();
  EXPECT_FALSE(tick(straight(*query_)).plan_query) << "now it is free";
  EXPECT_GT(tick().status.clearance_m, 1.0);

  appears(2, {14, 0, -3}, 0.6);
  outputs = tick();
  ASSERT_TRUE(outputs.plan_query);
  EXPECT_EQ(outputs.plan_query->cause, "the path is blocked or has ended");
  EXPECT_LE(outputs.command.v, 0.0);
  EXPECT_LE(tick(straight(*query_)).command.v, 0.0) << "not along that";
  vanishes(2);
  tick();
  tick(straight(*query_));
  EXPECT_GT(run(1.0).command.v, 0.35);
  EXPECT_TRUE(failsafes_.empty());
}

TEST_F(UnknownWater, WithoutRangeDataItStopsHoldsAndRetracesItsTrail) {
  use("cautious", "overhead=\"true\"");
  swim(30.0);
  ASSERT_EQ(visited_.back(), "in");
  sees_ = false;
  EXPECT_GT(run(0.9).command.v, 0.35);
  EXPECT_LE(run(0.2).command.v, 0.0);
  EXPECT_TRUE(failsafes_.empty());
  EXPECT_EQ(run(1.0).status.rung, "hold");
  EXPECT_EQ(failsafes_.at(0).cause, "range_lost");
  run(15.0);
  EXPECT_EQ(failsafes_.size(), 1U);
  const StepOutputs leaving = run(10.0);
  EXPECT_EQ(leaving.status.state, "dive.abort_retrace") << "though it is under an overhead";
  EXPECT_GT(leaving.command.v, 0.3) << "its trail it knows";
  for (int i = 0; i < 10'000 && executive_->result().outcome == Outcome::kRunning; ++i) {
    const StepOutputs outputs = tick();
    if (outputs.estimate.X_WB.p.x() > 0.0) {
      EXPECT_GT(outputs.command.d, 2.5);
    }
  }
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
  EXPECT_LT(depth_, 0.3);
}

TEST_F(UnknownWater, NewRangeDataEndTheHold) {
  swim(20.0);
  sees_ = false;
  EXPECT_EQ(run(5.0).status.rung, "hold");
  sees_ = true;
  EXPECT_GT(swim(6.0).command.v, 0.35);
  EXPECT_EQ(failsafes_.back().rung, "none");
}

TEST_F(UnknownWater, ADeclaredOverheadCountsWithoutAnObservation) {
  use("cautious", "overhead=\"true\"");
  swim(35.0);
  ASSERT_EQ(visited_.back(), "in");
  leak_ = true;
  EXPECT_EQ(swim(3.0).status.state, "dive.abort_retrace");
  double shallowest_inside = 100.0;
  for (int i = 0; i < 10'000 && executive_->result().outcome == Outcome::kRunning; ++i) {
    const StepOutputs outputs = tick();
    if (outputs.estimate.X_WB.p.x() > 0.0) {
      shallowest_inside = std::min(shallowest_inside, outputs.command.d);
    }
  }
  EXPECT_GT(shallowest_inside, 2.5);
  EXPECT_EQ(executive_->result().final_state, "dive.aborted");
  EXPECT_LT(depth_, 0.3);
}

// `in` is under an overhead, `gate` is not.
TEST_F(UnknownWater, PathsRiseAsFarAsTheMissionAndTheOverheadAllow) {
  const planning::Scene scene(nothing_);
  const auto rise_of = [&](const std::string& state, const std::string& limit) {
    use("optimistic", "overhead=\"true\"", limit);
    const BehaviorContext context = make_behavior_context(mission_, scene, 1);
    const StateIndex index(mission_);
    for (int i = 0; i < index.size(); ++i) {
      if (index.spec(i).id.value == state) return leg_settings(context, index.spec(i)).max_rise;
    }
    throw std::runtime_error(state);
  };
  EXPECT_EQ(rise_of("gate", ""), std::nullopt);
  EXPECT_EQ(rise_of("in", ""), 0.3);
  EXPECT_EQ(rise_of("gate", "max_depth_change=\"0.5\" "), 0.5);
  EXPECT_EQ(rise_of("in", "max_depth_change=\"0.5\" "), 0.3);
  EXPECT_EQ(rise_of("in", "max_depth_change=\"0.2\" "), 0.2);
}

// `back` does not declare an overhead, but it begins where `in` was.
TEST_F(UnknownWater, ARetraceUsesTheDeclaredOverheads) {
  use("cautious", "overhead=\"true\"");
  double shallowest_inside = 100.0;
  for (int i = 0; i < 20'000 && executive_->result().outcome == Outcome::kRunning; ++i) {
    const StepOutputs outputs = swim(0.02);
    if (outputs.estimate.X_WB.p.x() > 0.0) {
      shallowest_inside = std::min(shallowest_inside, outputs.command.d);
    }
  }
  EXPECT_EQ(executive_->result().outcome, Outcome::kSuccess) << executive_->result().cause;
  EXPECT_GT(shallowest_inside, 2.5);
  EXPECT_THAT(visited_, ::testing::ElementsAre("gate", "in", "back", "ascend", "surfaced"));
}

TEST_F(UnknownWater, ObservedObstaclesAreGroundAndOverhead) {
  use("cautious", "");
  swim(5.0);
  const double x = tick().estimate.X_WB.p.x();
  appears_ = {{1, {block({x + 1.0, 0, -7.5}, 4.0)}}};
  for (int i = 0; i < 100; ++i) tick();
  leak_ = true;
  appears_ = {{2, {block({x + 1.0, 0, -1}, 1.0)}}};
  EXPECT_EQ(run(2.0).status.state, "dive.abort_retrace") << "there is something above";
}

TEST_F(UnknownWater, ScansFromTheFutureAreRejected) {
  swim(3.0);
  sees_ = false;
  StepInputs inputs;
  inputs.now = now_ += 20'000;
  inputs.free_ahead = planning::FreeAhead{now_ + from_seconds(100), 5.0};
  EXPECT_GT(executive_->step(inputs).command.v, 0.3);
  EXPECT_EQ(run(2.2).status.rung, "hold") << "it would never have been stale";
}

TEST(PlannerServiceInUnknownWater, PlansRoundObservedObstaclesAndThroughDeletedOnes) {
  planning::ConvexSolid body{"body", block({0, 0, 0}, 0.4).vertices};
  const planning::World nothing;
  PlannerService service(nothing, {{body}}, {}, from_seconds(0.1));
  const auto length = [&](Utime now) {
    PlanQuery query;
    query.id = now;
    query.request.start.p = {0, 0, -5};
    query.request.goal.p = {8, 0, -5};
    service.submit(query, now);
    const std::optional<PlanReply> reply = service.poll(now + from_seconds(1.0));
    EXPECT_TRUE(reply && reply->plan.status == planning::PlanStatus::kSuccess);
    return reply ? reply->plan.length_m : 0.0;
  };
  EXPECT_NEAR(length(0), 8.0, 0.02);
  planning::ObservedMap map;
  ASSERT_TRUE(map.apply({planning::ObstacleSource::kMapper, 1, {{3, {block({4, 0, -5}, 2.0)}}}}));
  service.set_map(map);
  EXPECT_GT(length(1), 8.4);
  EXPECT_GT(length(2), 8.4);
  ASSERT_TRUE(map.apply({planning::ObstacleSource::kMapper, 2, {{3, {}}}}));
  EXPECT_GT(length(3), 8.4) << "the snapshot has not changed";
  service.set_map(map);
  EXPECT_NEAR(length(4), 8.0, 0.02);
}

}  // namespace
}  // namespace dive::mission
