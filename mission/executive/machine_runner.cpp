#include "mission/executive/machine_runner.h"

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {

using statechart::StateId;

MachineRunner::MachineRunner(const Machine& machine, Observer& observer, StepOutputs& outputs)
    : machine_(machine),
      observer_(observer),
      outputs_(outputs),
      interpreter_(machine.chart, *this),
      entered_at_(machine.chart.states.size()),
      timeout_reported_(machine.chart.states.size()),
      done_once_(machine.actions.size()) {
  evaluated_.reserve(machine.guards.size());
}

bool MachineRunner::evaluate(statechart::GuardId guard) {
  const bool is_true = machine_.guards[static_cast<std::size_t>(guard)].evaluate(variables_);
  if (evaluated_.size() < evaluated_.capacity()) evaluated_.emplace_back(guard, is_true);
  return is_true;
}

void MachineRunner::execute(statechart::ActionId id) {
  const auto index = static_cast<std::size_t>(id);
  const ActionSpec& action = machine_.actions[index];
  switch (action.kind) {
    case ActionSpec::Kind::kLog:
      outputs_.actions.push_back({ActionRecord::Kind::kLog, action.text.value});
      return;
    case ActionSpec::Kind::kRaise:
      interpreter_.raise(action.text.value);
      return;
    case ActionSpec::Kind::kPayload:
      if (action.once && done_once_[index]) return;
      done_once_[index] = true;
      outputs_.actions.push_back({ActionRecord::Kind::kPayload, action.text.value, action.once});
      return;
  }
}

void MachineRunner::entered(StateId state) {
  const auto index = static_cast<std::size_t>(state);
  const statechart::State& entered_state = machine_.chart.states[index];
  entered_at_[index] = mission_now_;
  timeout_reported_[index] = false;
  if (entered_state.kind == statechart::StateKind::kFinal) {
    if (entered_state.parent == 0) final_state_ = entered_state.id;
  } else if (entered_state.kind == statechart::StateKind::kAtomic) {
    observer_.on_entered_atomic(state);
    refuse_to_surface_under_an_overhead(state);
  }
  if (outputs_.transitions.empty()) {
    outputs_.transitions.push_back({"", "", "", "the mission starts", ""});
  }
  outputs_.transitions.back().to = entered_state.id;
}

void MachineRunner::taken(int /*transition*/, const std::string& event) {
  const std::string here = innermost();
  outputs_.transitions.push_back({here, here, event,
                                  event.empty() ? "its guard became true" : event_cause_,
                                  describe_guards()});
  evaluated_.clear();
}

void MachineRunner::refuse_to_surface_under_an_overhead(StateId state) {
  const auto index = static_cast<std::size_t>(state);
  const bool surfaces = !machine_.is_own(state) && is_surfacing(*machine_.specs[index]);
  if (!surfaces || !variables_.overhead) return;
  abort_cause_ = event_cause_ = machine_.chart.states[index].id + " was entered under an overhead";
  interpreter_.raise(kAbortEvent);
}

void MachineRunner::dispatch(const Event& event) {
  event_cause_ = event.cause;
  evaluated_.clear();
  const std::size_t before = outputs_.transitions.size();
  interpreter_.dispatch(event.name);
  DIVE_DEMAND(!interpreter_.livelocked());
  if (outputs_.transitions.size() == before && !evaluated_.empty()) {
    outputs_.actions.push_back(
        {ActionRecord::Kind::kNote,
         fmt::format("{}: no transition taken: {}", event.name, describe_guards())});
  }
  variables_.state_elapsed = state_elapsed_s();
}

std::optional<Event> MachineRunner::next_timeout() {
  for (std::size_t index = 0; index < entered_at_.size(); ++index) {
    if (timeout_reported_[index] || machine_.specs[index] == nullptr) continue;
    const std::optional<Timeout>& timeout = machine_.specs[index]->timeout;
    if (!timeout || !interpreter_.is_active(static_cast<StateId>(index))) continue;
    if (to_seconds(mission_now_ - entered_at_[index]) <= timeout->seconds.value) continue;
    timeout_reported_[index] = true;
    const std::string& id = machine_.chart.states[index].id;
    return Event{"timeout." + id,
                 fmt::format("{} took longer than {:g} s", id, timeout->seconds.value)};
  }
  return std::nullopt;
}

void MachineRunner::settle() {
  evaluated_.clear();
  interpreter_.settle();
  DIVE_DEMAND(!interpreter_.livelocked());
}

std::string MachineRunner::describe_guards() const {
  std::string text;
  for (const auto& [guard, is_true] : evaluated_) {
    if (!text.empty()) text += ", ";
    const Guard& of = machine_.guards[static_cast<std::size_t>(guard)];
    text += fmt::format("{}: {} ({})", of.text(), is_true, of.describe(variables_));
  }
  return text;
}

const std::string& MachineRunner::innermost() const {
  for (std::size_t i = machine_.chart.states.size(); i-- > 1;) {
    if (interpreter_.is_active(static_cast<StateId>(i))) return machine_.chart.states[i].id;
  }
  return final_state_;
}

double MachineRunner::state_elapsed_s() const {
  for (std::size_t i = entered_at_.size(); i-- > 0;) {
    if (interpreter_.is_active(static_cast<StateId>(i))) {
      return to_seconds(mission_now_ - entered_at_[i]);
    }
  }
  return 0.0;
}

void MachineRunner::save(Checkpoint& checkpoint) const {
  const statechart::Interpreter::Memory memory = interpreter_.memory();
  keep_memory(memory, machine_.chart, checkpoint);
  for (const StateId state : memory.active) {
    checkpoint.active_s.push_back(
        to_seconds(mission_now_ - entered_at_[static_cast<std::size_t>(state)]));
  }
  for (std::size_t i = 0; i < done_once_.size(); ++i) {
    if (done_once_[i]) checkpoint.done_once.push_back(static_cast<int>(i));
  }
  checkpoint.abort_cause = abort_cause_;
}

void MachineRunner::restore(const Checkpoint& checkpoint) {
  for (const int action : checkpoint.done_once) {
    done_once_.at(static_cast<std::size_t>(action)) = true;
  }
  abort_cause_ = checkpoint.abort_cause;
  const statechart::Interpreter::Memory memory = memory_of(checkpoint, machine_.chart);
  interpreter_.restore(memory);
  for (std::size_t i = 0; i < memory.active.size(); ++i) {
    const auto index = static_cast<std::size_t>(memory.active[i]);
    entered_at_[index] = mission_now_ - from_seconds(checkpoint.active_s.at(i));
    if (machine_.chart.states[index].kind != statechart::StateKind::kAtomic) continue;
    observer_.on_entered_atomic(memory.active[i]);
    refuse_to_surface_under_an_overhead(memory.active[i]);
  }
}

}  // namespace dive::mission
