// A leak at the deepest point of a penetration, evaluated by ground truth: with the trail free,
// with the trail blocked, and without any exit path.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/cli/loading.h"
#include "mission/simulation/simulated_dive.h"
#include "planning/world/overhead.h"

namespace dive::mission {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

struct Dived {
  DiveResult result;
  Eigen::Vector3d retraced_W = Eigen::Vector3d::Zero();  ///< End of the retrace, ground truth.
  std::vector<std::string> plan_causes;  ///< Causes of the plans requested by the abort.
  std::vector<std::string> states;
};

Dived dive(const Mission& mission, const planning::World& world, const vehicle::Model& model,
           const std::vector<Fault>& faults) {
  DiveSettings settings;
  settings.faults = faults;
  Dived dived;
  dived.result =
      simulate_dive(mission, world, model, settings,
                    [&](const StepInputs&, const StepOutputs& outputs,
                        const vehicle::GroundTruth& truth, const auto&) {
                      for (const auto& transition : outputs.transitions) {
                        if (transition.to == "dive.abort_surface") dived.retraced_W = truth.X_WB.p;
                      }
                      if (outputs.plan_query && outputs.plan_query->state == "dive.abort_retrace") {
                        dived.plan_causes.push_back(outputs.plan_query->cause);
                      }
                    });
  for (const TimedTransition& transition : dived.result.transitions) {
    dived.states.push_back(transition.record.to);
  }
  return dived;
}

class Penetration : public ::testing::Test {
 protected:
  void SetUp() override {
    Diagnostics diagnostics;
    auto loaded = load(DIVE_SOURCE_DIR "/missions/penetration.xml", planning::Resources::kInFolder,
                       diagnostics);
    ASSERT_TRUE(loaded);
    loaded_.emplace(std::move(*loaded));
    const Dived nominal = in_the_wreck({});
    ASSERT_EQ(nominal.result.outcome, "success") << nominal.result.cause;
    for (const TimedTransition& transition : nominal.result.transitions) {
      if (transition.record.from == "wreck-inside")
        at_s_ = transition.t_s - 2.0;  // at the last goal
    }
    ASSERT_GT(at_s_, 30.0);
  }
  [[nodiscard]] Dived in_the_wreck(const std::vector<Fault>& faults) const {
    return dive(loaded_->mission, loaded_->world, loaded_->model, faults);
  }
  [[nodiscard]] bool is_in_open_water(const Eigen::Vector3d& p_W) const {
    return !planning::OverheadIndex(loaded_->world).is_above(p_W, 0.4);
  }

  std::optional<LoadedMission> loaded_;
  double at_s_ = 0.0;
};

TEST_F(Penetration, ALeakAtTheDeepestPointEndsInARetraceToOpenWater) {
  const Dived dived = in_the_wreck({{FaultKind::kLeak, at_s_}});
  EXPECT_TRUE(dived.result.collisions.empty());
  EXPECT_EQ(dived.result.final_state, "dive.aborted");
  EXPECT_LT(dived.result.final_depth_m, 0.5);
  EXPECT_TRUE(is_in_open_water(dived.retraced_W)) << dived.retraced_W.transpose();
  EXPECT_THAT(dived.states, Contains("dive.abort_retrace"));
  EXPECT_TRUE(dived.plan_causes.empty()) << "the trail needs no plan";
}

TEST_F(Penetration, ABlockedTrailIsLeftOnAPlannedExitPath) {
  const Dived dived = in_the_wreck({{FaultKind::kBlocked, at_s_}, {FaultKind::kLeak, at_s_}});
  EXPECT_TRUE(dived.result.collisions.empty()) << "the fallen obstacle counts";
  EXPECT_EQ(dived.result.final_state, "dive.aborted");
  EXPECT_LT(dived.result.final_depth_m, 0.5);
  EXPECT_TRUE(is_in_open_water(dived.retraced_W)) << dived.retraced_W.transpose();
  EXPECT_THAT(dived.plan_causes, Contains("the trail is blocked"));
}

// A blind tunnel, too narrow to pass the object that falls into it.
TEST(BlindTunnel, WithoutAnyWayOutItReportsThatAndTakesTheLastRung) {
  constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="tunnel">
    <vehicle model="aqua2" speed="0.3" attitude="horizontal"/>
    <map file="none.sdf"/>
    <start x="-4" y="0" z="5" z_units="DEPTH" heading_deg="90"/>
    <limits max_depth="8" min_altitude="0" clearance="0.1" mission_timeout="300"
            battery_reserve="0.2"/>
    <states initial="in">
      <wreck_penetration id="in" max_penetration="30" timeout="200" on_timeout="back">
        <entry x="-2" y="0" z="5" z_units="DEPTH" capture_radius="0.3"/>
        <goal id="end" x="9" y="0" z="5" z_units="DEPTH" capture_radius="0.3" dwell="60"/>
        <transition event="done.state.in plan.failed.in" target="ascend"/>
      </wreck_penetration>
      <retrace id="back"><transition event="done.state.back" target="ascend"/></retrace>
      <surface id="ascend"><transition event="done.state.ascend" target="surfaced"/></surface>
      <final id="surfaced"/>
    </states>
  </mission>)";
  planning::World world;
  const auto add = [&world](const char* name, const Eigen::Vector3d& size,
                            const Eigen::Vector3d& at) {
    world.obstacles.push_back({name, planning::Box{size}, Pose{at, {}}});
  };
  add("north", {12, 1, 3}, {6, 1.02, -5});
  add("south", {12, 1, 3}, {6, -1.02, -5});
  add("roof", {12, 3.4, 1}, {6, 0, -4.08});
  add("floor", {12, 3.4, 1}, {6, 0, -5.92});
  add("end", {1, 3.4, 3}, {12.5, 0, -5});
  Diagnostics diagnostics;
  const auto mission =
      parse_mission(SourceText("tunnel.xml", kMission), diagnostics, MapFile::kNotNeeded);
  ASSERT_TRUE(mission) << render(diagnostics.list().front(), false);
  const Dived dived = dive(*mission, world, load_vehicle(),
                           {{FaultKind::kBlocked, 50.0}, {FaultKind::kLeak, 50.0}});
  ASSERT_FALSE(dived.result.failsafes.empty());
  EXPECT_EQ(dived.result.failsafes.back().rung, "emergency_surface");
  EXPECT_EQ(dived.result.failsafes.back().cause, "retrace_failure");
  EXPECT_THAT(dived.result.failsafes.back().why, HasSubstr("there is no exit path"));
  EXPECT_THAT(dived.states, Contains("dive.emergency"));
  EXPECT_EQ(dived.plan_causes.size(), 4U) << "with less and less clearance, and then no more";
}

}  // namespace
}  // namespace dive::mission
