// At 50 Hz for hours, the executive must not depend on the allocator.

#include <gtest/gtest.h>

#include "mission/executive/executive.h"
#include "test/common/allocations.h"

namespace dive::mission {
namespace {

// Names longer than a std::string stores inline, every failsafe monitored, and guards.
constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="test">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map file="none.sdf" fixes="off"/>
  <start x="-4" y="0" z="3" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="6" min_altitude="0.3" clearance="0.6" mission_timeout="1000"
          battery_reserve="0.2"/>
  <replan deviation="2" no_progress="500"/>
  <states initial="a_state_of_a_rather_long_name">
    <state id="a_state_of_a_rather_long_name" initial="the_leg_to_the_far_end_of_the_pool">
      <goto id="the_leg_to_the_far_end_of_the_pool" x="100" y="0" z="3" z_units="DEPTH"
            timeout="400" on_timeout="the_wait_for_what_comes_next">
        <transition cond="depth &gt; 5 m or altitude &lt; 0.1 m" target="ascend"/>
      </goto>
      <hold id="the_wait_for_what_comes_next" duration="100">
        <transition event="done.state.the_wait_for_what_comes_next" target="ascend"/>
      </hold>
      <transition cond="battery_fraction &lt; 10 % and elapsed &gt; 3 s" target="ascend"/>
    </state>
    <surface id="ascend">
      <transition event="done.state.ascend" target="surfaced"/>
    </surface>
    <final id="surfaced"/>
  </states>
</mission>)";

class StepAllocation : public ::testing::Test {
 protected:
  StepAllocation() {
    use(kMission);
    world_.obstacles.push_back({"bottom", planning::Box{{400, 40, 1}}, Pose{{0, 0, -8}}});
    world_.obstacles.push_back({"roof", planning::Box{{40, 40, 0.5}}, Pose{{25, 0, -0.5}}});
    executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
    inputs_.imu = ImuSample{};
    inputs_.imu->q_WB = from_rpy(0, 0, 0);
    inputs_.imu->accel_B.z() = 9.81;
    inputs_.depth = DepthSample{0, 3.0};
    inputs_.health = HealthSample{};
  }

  void use(const std::string& text) {
    Diagnostics diagnostics;
    model_ = *vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
    mission_ = *parse_mission(SourceText("test.xml", text), diagnostics, MapFile::kNotNeeded);
    executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  }

  const StepOutputs& tick() {
    inputs_.now += 20'000;
    noise_ = -noise_;  // a working sensor is never quite constant
    inputs_.imu->utime = inputs_.depth->utime = inputs_.health->utime = inputs_.now;
    inputs_.imu->q_WB = from_rpy(0, 0, noise_);
    inputs_.depth->depth_m = 3.0 + noise_;
    if (inputs_.free_ahead) inputs_.free_ahead->scan_utime = inputs_.now;
    return executive_->step(inputs_);
  }

  // Number of ticks in the next `seconds` that allocated although nothing began or ended.
  int ticks_that_allocate(double seconds) {
    int count = 0;
    for (const Utime end = inputs_.now + from_seconds(seconds); inputs_.now < end;) {
      testing::reset_allocations();
      const StepOutputs& outputs = tick();
      const bool allocated = testing::allocations().count > 0;
      const bool is_quiet = outputs.transitions.empty() && outputs.failsafes.empty() &&
                            outputs.actions.empty() && !outputs.plan_query;
      quiet_ += is_quiet ? 1 : 0;
      count += is_quiet && allocated ? 1 : 0;
    }
    return count;
  }

  // Swims to the far end of the pool.
  void swim() {
    const StepOutputs& first = tick();
    ASSERT_TRUE(first.plan_query);
    PlanReply reply;
    reply.id = first.plan_query->id;
    reply.plan.status = planning::PlanStatus::kSuccess;
    reply.plan.accepted = true;
    for (int i = 0; i <= 50; ++i) {
      Pose waypoint = first.plan_query->request.start;
      waypoint.p.x() += 2.08 * i;
      reply.plan.waypoints.push_back(waypoint);
    }
    reply.plan.waypoints.back() = first.plan_query->request.goal;
    reply.plan.clearance_m = 0.9;
    inputs_.plan = reply;
    tick();
    inputs_.plan.reset();
    tick();  // its strings and lists reach their sizes
  }

  vehicle::Model model_;
  Mission mission_;
  planning::World world_;
  std::optional<Executive> executive_;
  StepInputs inputs_;
  double noise_ = 1e-4;
  int quiet_ = 0;
};

TEST_F(StepAllocation, NoneWhileAPathIsFollowedNorWhileTheVehicleHolds) {
  swim();
  EXPECT_EQ(ticks_that_allocate(100.0), 0);
  EXPECT_EQ(executive_->step(inputs_).status.state, "the_leg_to_the_far_end_of_the_pool");
  EXPECT_GT(executive_->step(inputs_).status.segment, 10) << "it must have moved on";
  ticks_that_allocate(350.0);
  ASSERT_EQ(executive_->step(inputs_).status.state, "the_wait_for_what_comes_next");
  EXPECT_EQ(ticks_that_allocate(20.0), 0);
  EXPECT_GT(quiet_, 20'000);
}

// Thousands of pieces below, beside and above, and twenty scans a second without a new observation.
TEST_F(StepAllocation, NoneInAnUnknownEnvironmentWithoutNewObservations) {
  world_ = {};
  std::string text = kMission;
  const std::string known = "<map file=\"none.sdf\" fixes=\"off\"/>";
  use(text.replace(text.find(known), known.size(), "<map unknown=\"cautious\"/>"));
  planning::ObstacleUpdate update;
  for (int i = 0; i < 1000; ++i) {
    planning::MapCell& cell = update.cells.emplace_back();
    cell.key = i;
    for (const Eigen::Vector3d& at :
         {Eigen::Vector3d(0.1 * i, 0, -6), Eigen::Vector3d(0.1 * i, 2, -3),
          Eigen::Vector3d(0.1 * i, 0.5, -0.5)}) {
      planning::Polytope& piece = cell.pieces.emplace_back();
      for (const double dx : {0.0, 0.1, 0.2, 0.3}) {
        for (const double dy : {0.0, 0.1, 0.15, 0.3}) {
          piece.vertices.push_back(at + Eigen::Vector3d(dx, dy, 0.1 * dx * dy));
        }
      }
    }
  }
  ASSERT_TRUE(inputs_.observed_map.apply(update));
  inputs_.free_ahead = planning::FreeAhead{0, 5.0};
  swim();
  EXPECT_EQ(ticks_that_allocate(100.0), 0);
  EXPECT_GT(executive_->step(inputs_).status.segment, 10) << "it must have moved on";
}

}  // namespace
}  // namespace dive::mission
