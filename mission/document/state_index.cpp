#include "mission/document/state_index.h"

#include <fmt/format.h>

#include "mission/states/atomic_state.h"

namespace dive::mission {

StateIndex::StateIndex(const Mission& mission) {
  for (const StateSpec& spec : mission.states) add(spec, -1);
}

void StateIndex::add(const StateSpec& spec, int parent) {
  const int state = size();
  entries_.push_back({&spec, parent, state});
  by_id_.emplace(spec.id.value, state);
  for (const StateSpec& child : spec.children) add(child, state);
  entries_[static_cast<std::size_t>(state)].last = size() - 1;
}

int StateIndex::find(const std::string& id) const {
  const auto found = by_id_.find(id);
  return found == by_id_.end() ? -1 : found->second;
}

std::vector<int> StateIndex::children(int state) const {
  std::vector<int> children;
  const int last = state < 0 ? size() - 1 : at(state).last;
  for (int child = state + 1; child <= last; child = at(child).last + 1) children.push_back(child);
  return children;
}

int StateIndex::outermost_parallel(int state) const {
  int outermost = -1;
  for (int s = state; s >= 0; s = parent(s)) {
    if (spec(s).type == StateType::kParallel) outermost = s;
  }
  return outermost;
}

std::vector<std::string> StateIndex::ids() const {
  std::vector<std::string> ids;
  for (const auto& [id, state] : by_id_) ids.push_back(id);
  return ids;
}

bool is_history(const StateSpec& spec) {
  return spec.type == StateType::kShallowHistory || spec.type == StateType::kDeepHistory;
}

bool is_behavior(const StateSpec& spec) {
  return spec.type == StateType::kAtomic && spec.atomic != nullptr;
}

bool is_planning(const StateSpec& spec) { return !goals_of(spec).empty(); }

std::vector<const ActionSpec*> actions_of(const StateSpec& spec) {
  std::vector<const ActionSpec*> actions;
  const auto add = [&actions](const std::vector<ActionSpec>& more) {
    for (const ActionSpec& action : more) actions.push_back(&action);
  };
  add(spec.on_entry);
  add(spec.on_exit);
  for (const TransitionSpec& transition : spec.transitions) add(transition.actions);
  return actions;
}

std::set<std::string> raised_events(const StateIndex& index) {
  std::set<std::string> events;
  for (int state = 0; state < index.size(); ++state) {
    for (const ActionSpec* action : actions_of(index.spec(state))) {
      if (action->kind == ActionSpec::Kind::kRaise) events.insert(action->text.value);
    }
  }
  return events;
}

const Timeout* state_timeout(const StateSpec& spec) {
  return spec.timeout ? &*spec.timeout : nullptr;
}

std::vector<const Goal*> goals_of(const StateSpec& spec) {
  return spec.atomic ? spec.atomic->goals() : std::vector<const Goal*>();
}

std::set<std::string> possible_events(const StateIndex& index) {
  std::set<std::string> events = raised_events(index);
  events.insert({"abort", "operator.pause", "operator.resume", "operator.skip", "map.changed",
                 "estimator.switched", "loop.closed"});
  for (std::size_t i = 0; i < behaviors::kFailsafeCount; ++i) {
    const auto& traits = behaviors::traits(static_cast<behaviors::FailsafeKind>(i));
    if (traits.in_missions) events.insert(fmt::format("failsafe.{}", traits.name));
  }
  for (int state = 0; state < index.size(); ++state) {
    const StateSpec& spec = index.spec(state);
    if (is_behavior(spec) || spec.type == StateType::kParallel) {
      events.insert("done.state." + spec.id.value);
    }
    if (spec.type == StateType::kFinal && index.parent(state) >= 0) {
      events.insert("done.state." + index.spec(index.parent(state)).id.value);
    }
    if (is_planning(spec)) events.insert("plan.failed." + spec.id.value);
    if (state_timeout(spec) != nullptr) events.insert("timeout." + spec.id.value);
  }
  return events;
}

Span span_of_state(const Mission& mission, const std::string& id) {
  const StateIndex index(mission);
  const int state = index.find(id);
  return state < 0 ? mission.initial.span : index.spec(state).id.span;
}

}  // namespace dive::mission
