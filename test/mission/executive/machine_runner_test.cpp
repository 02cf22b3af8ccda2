// The machine of a mission between the executive and the statechart: timeouts, actions executed
// once, notes on events without a transition, and the state kept for a restart.

#include "mission/executive/machine_runner.h"

#include <algorithm>
#include <optional>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dive::mission {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="test">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map file="none.sdf"/>
  <start x="-4" y="0" z="3" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="6" min_altitude="0.3" clearance="0.6" mission_timeout="100"
          battery_reserve="0.2"/>
  <states initial="first">
    <goto id="first" x="6" y="0" z="3" z_units="DEPTH" timeout="40" on_timeout="up">
      <onentry><payload command="photo" once="true"/></onentry>
      <transition event="operator.pause" cond="depth &gt; 5 m" target="second"/>
      <transition event="operator.resume" target="first"/>
      <transition event="done.state.first" target="up"/>
    </goto>
    <hold id="second" duration="10">
      <transition event="done.state.second" target="up"/>
    </hold>
    <surface id="up"><transition event="done.state.up" target="end"/></surface>
    <final id="end"/>
  </states>
</mission>)";

class MachineRunnerTest : public ::testing::Test, public MachineRunner::Observer {
 protected:
  void SetUp() override {
    Diagnostics diagnostics;
    std::optional<Mission> mission =
        parse_mission(SourceText("test.xml", kMission), diagnostics, MapFile::kNotNeeded);
    ASSERT_TRUE(mission) << render(diagnostics.list().at(0), false);
    mission_ = std::move(*mission);
    machine_ = build_machine(mission_);
    runner_.emplace(machine_, *this, outputs_);
    runner_->start();
  }

  void on_entered_atomic(statechart::StateId state) override { entered_.push_back(name(state)); }
  void on_exited(statechart::StateId state) override { exited_.push_back(name(state)); }
  [[nodiscard]] std::string name(statechart::StateId state) const {
    return machine_.chart.states[static_cast<std::size_t>(state)].id;
  }
  [[nodiscard]] int count(ActionRecord::Kind kind) const {
    return static_cast<int>(std::ranges::count(outputs_.actions, kind, &ActionRecord::kind));
  }

  Mission mission_;
  Machine machine_;
  StepOutputs outputs_;
  std::optional<MachineRunner> runner_;
  std::vector<std::string> entered_;
  std::vector<std::string> exited_;
};

TEST_F(MachineRunnerTest, FollowsEventsAndCallsItsObserver) {
  EXPECT_EQ(runner_->innermost(), "first");
  GuardVariables variables;
  variables.depth = 5.5;
  runner_->set_variables(variables);
  runner_->dispatch({"operator.pause", "a test"});
  EXPECT_THAT(entered_, ElementsAre("first", "second"));
  EXPECT_THAT(exited_, ElementsAre("first"));
  const TransitionRecord& record = outputs_.transitions.back();
  EXPECT_EQ(record.from, "first");
  EXPECT_EQ(record.to, "second");
  EXPECT_EQ(record.cause, "a test");
  EXPECT_THAT(record.guards, HasSubstr("depth > 5 m: true"));
}

TEST_F(MachineRunnerTest, NotesAnEventThatLeadsNowhereWithTheValuesOfItsGuards) {
  runner_->dispatch({"operator.pause", "a test"});
  EXPECT_EQ(runner_->innermost(), "first");
  ASSERT_EQ(count(ActionRecord::Kind::kNote), 1);
  EXPECT_THAT(outputs_.actions.back().text,
              HasSubstr("operator.pause: no transition taken: depth > 5 m: false"));
  runner_->dispatch({"unknown.event", "a test"});
  EXPECT_EQ(count(ActionRecord::Kind::kNote), 1) << "no guard was asked";
}

TEST_F(MachineRunnerTest, ReportsATimeoutOnce) {
  runner_->set_time(40'000'000);
  EXPECT_FALSE(runner_->next_timeout());
  runner_->set_time(40'020'000);
  const std::optional<Event> timeout = runner_->next_timeout();
  ASSERT_TRUE(timeout);
  EXPECT_EQ(timeout->name, "timeout.first");
  EXPECT_EQ(timeout->cause, "first took longer than 40 s");
  EXPECT_FALSE(runner_->next_timeout());
  runner_->dispatch({"operator.resume", "entered again"});
  runner_->set_time(80'060'000);
  EXPECT_TRUE(runner_->next_timeout()) << "of a new entry";
}

TEST_F(MachineRunnerTest, ARestartEntersNothingAndRepeatsNoActionThatIsDoneOnce) {
  runner_->set_time(30'000'000);
  EXPECT_EQ(count(ActionRecord::Kind::kPayload), 1);
  Checkpoint kept;
  runner_->save(kept);
  outputs_ = {};
  entered_.clear();
  MachineRunner restarted(machine_, *this, outputs_);
  restarted.set_time(1'000'000);
  restarted.restore(kept);
  EXPECT_EQ(restarted.innermost(), "first");
  EXPECT_NEAR(restarted.state_elapsed_s(), 30.0, 1e-9);
  EXPECT_THAT(entered_, ElementsAre("first")) << "its behaviour is needed";
  EXPECT_TRUE(outputs_.transitions.empty());
  restarted.dispatch({"operator.resume", "entered again"});
  EXPECT_EQ(count(ActionRecord::Kind::kPayload), 0);
}

// A mission's state that surfaces is exited at once if something is above.
TEST_F(MachineRunnerTest, DoesNotSurfaceUnderAnOverhead) {
  GuardVariables variables;
  variables.overhead = true;
  runner_->set_variables(variables);
  runner_->dispatch({"timeout.first", "a test"});
  EXPECT_EQ(runner_->innermost(), kAbortRetraceState);
  EXPECT_THAT(runner_->abort_cause(), HasSubstr("up was entered under an overhead"));
}

}  // namespace
}  // namespace dive::mission
