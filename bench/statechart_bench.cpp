// Cost of the state machine in the control loop, at 50 Hz.

#include <string>

#include <benchmark/benchmark.h>

#include "mission/statechart/interpreter.h"

namespace dive::statechart {
namespace {

class Silent : public Environment {
 public:
  bool evaluate(GuardId) override { return false; }
  void execute(ActionId) override {}
  void entered(StateId) override {}
  void exited(StateId) override {}
  void taken(int, const std::string&) override {}
};

/// A mission of `legs` legs in sequence, each monitored by a failsafe of the parent state.
Chart mission(int legs) {
  Chart chart;
  chart.add_state("mission", StateKind::kCompound, -1);
  const StateId dive = chart.add_state("dive", StateKind::kCompound, 0);
  for (int leg = 0; leg < legs; ++leg) {
    chart.add_state("leg" + std::to_string(leg), StateKind::kAtomic, dive);
  }
  const StateId surface = chart.add_state("surface", StateKind::kAtomic, 0);
  chart.set_initial(0, {dive});
  chart.set_initial(dive, {dive + 1});
  for (StateId leg = dive + 1; leg < surface; ++leg) {
    Transition done;
    done.source = leg;
    done.events = {"done.state." + chart.states[static_cast<std::size_t>(leg)].id};
    done.targets = {leg + 1 < surface ? leg + 1 : dive + 1};
    chart.add_transition(done);
  }
  for (const char* event :
       {"failsafe.leak", "failsafe.mission_timeout", "failsafe.overdepth", "abort"}) {
    Transition abort;
    abort.source = dive;
    abort.events = {event};
    abort.targets = {surface};
    chart.add_transition(abort);
  }
  return chart;
}

void BM_NothingEnabled(benchmark::State& state) {
  const Chart chart = mission(static_cast<int>(state.range(0)));
  Silent silent;
  Interpreter interpreter(chart, silent);
  interpreter.start();
  const std::string event = "estimate.updated";
  for (auto _ : state) {
    interpreter.settle();
    interpreter.dispatch(event);
  }
}
BENCHMARK(BM_NothingEnabled)->Arg(10)->Arg(100);

void BM_OneTransition(benchmark::State& state) {
  const auto legs = static_cast<int>(state.range(0));
  const Chart chart = mission(legs);
  Silent silent;
  Interpreter interpreter(chart, silent);
  interpreter.start();
  std::vector<std::string> events;
  for (int leg = 0; leg < legs; ++leg) events.push_back("done.state.leg" + std::to_string(leg));
  std::size_t next = 0;
  for (auto _ : state) {
    interpreter.dispatch(events[next]);
    next = next + 1 < events.size() ? next + 1 : 0;
  }
}
BENCHMARK(BM_OneTransition)->Arg(10)->Arg(100);

}  // namespace
}  // namespace dive::statechart
