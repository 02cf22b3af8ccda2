#include "mission/statechart/chart.h"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"

namespace dive::statechart {

StateId Chart::add_state(std::string id, StateKind kind, StateId parent) {
  DIVE_DEMAND(parent < static_cast<StateId>(states.size()));
  DIVE_DEMAND((parent < 0) == states.empty());
  const auto state = static_cast<StateId>(states.size());
  states.push_back({});
  states.back().id = std::move(id);
  states.back().kind = kind;
  states.back().parent = parent < 0 ? -1 : parent;
  if (parent >= 0) states[static_cast<std::size_t>(parent)].children.push_back(state);
  return state;
}

int Chart::add_transition(Transition transition) {
  DIVE_DEMAND(transition.source >= 0 && transition.source < static_cast<StateId>(states.size()));
  const auto index = static_cast<int>(transitions.size());
  states[static_cast<std::size_t>(transition.source)].transitions.push_back(index);
  transitions.push_back(std::move(transition));
  return index;
}

int Chart::set_initial(StateId state, std::vector<StateId> targets) {
  DIVE_DEMAND(state >= 0 && state < static_cast<StateId>(states.size()));
  const auto index = static_cast<int>(transitions.size());
  // Internal: entering a state's initial states must not exit the state.
  transitions.push_back({.source = state,
                         .events = {},
                         .guard = -1,
                         .targets = std::move(targets),
                         .internal = true,
                         .actions = {}});
  states[static_cast<std::size_t>(state)].initial = index;
  return index;
}

StateId Chart::find(const std::string& id) const {
  const auto found = std::ranges::find(states, id, &State::id);
  return found == states.end() ? -1 : static_cast<StateId>(found - states.begin());
}

bool Chart::is_descendant(StateId state, StateId ancestor) const {
  while (state > 0) {
    state = states[static_cast<std::size_t>(state)].parent;
    if (state == ancestor) return true;
  }
  return false;
}

namespace {

bool is_history(StateKind kind) {
  return kind == StateKind::kShallowHistory || kind == StateKind::kDeepHistory;
}

/// Each check relies on the earlier ones and returns a sentence, or an empty string.
class Validator {
 public:
  explicit Validator(const Chart& chart) : chart_(chart) {}

  [[nodiscard]] std::string run() const {
    std::string wrong = check_tree();
    if (wrong.empty()) wrong = check_ids();
    for (StateId s = 0; wrong.empty() && s < count(); ++s) wrong = check_kind(s);
    for (StateId s = 0; wrong.empty() && s < count(); ++s) wrong = check_own_transitions(s);
    if (wrong.empty()) wrong = check_transitions_are_listed_once();
    for (StateId s = 0; wrong.empty() && s < count(); ++s) wrong = check_initial(s);
    return wrong;
  }

 private:
  [[nodiscard]] StateId count() const { return static_cast<StateId>(chart_.states.size()); }
  [[nodiscard]] const State& state(StateId s) const {
    return chart_.states[static_cast<std::size_t>(s)];
  }
  [[nodiscard]] const Transition& transition(int t) const {
    return chart_.transitions[static_cast<std::size_t>(t)];
  }
  [[nodiscard]] bool is_state(StateId s) const { return s >= 0 && s < count(); }
  [[nodiscard]] bool is_transition(int t) const {
    return t >= 0 && t < static_cast<int>(chart_.transitions.size());
  }

  /// Parents and children are consistent, and a depth-first walk visits 0, 1, 2, ...
  [[nodiscard]] std::string check_tree() const {
    if (count() == 0) return "the chart has no states";
    std::vector<StateId> pending{0};
    std::vector<StateId> parents{-1};
    for (StateId expected = 0; expected < count(); ++expected) {
      if (pending.empty()) {
        return fmt::format("state '{}' is not below the root", state(expected).id);
      }
      const StateId s = pending.back();
      const StateId parent = parents.back();
      pending.pop_back();
      parents.pop_back();
      if (s != expected) {
        return fmt::format("state '{}' is out of document order", state(expected).id);
      }
      if (state(s).parent != parent) {
        return fmt::format("state '{}' does not name its parent", state(s).id);
      }
      const auto& children = state(s).children;
      pending.insert(pending.end(), children.rbegin(), children.rend());
      parents.insert(parents.end(), children.size(), s);
    }
    return pending.empty() ? "" : "a child state does not exist";
  }

  [[nodiscard]] std::string check_ids() const {
    std::set<std::string> seen;
    for (const State& s : chart_.states) {
      if (s.id.empty()) return "a state has no id";
      if (!seen.insert(s.id).second) return fmt::format("two states have the id '{}'", s.id);
    }
    return "";
  }

  [[nodiscard]] std::string check_kind(StateId id) const {
    const State& s = state(id);
    const bool has_states = std::ranges::any_of(
        s.children, [this](StateId child) { return !is_history(state(child).kind); });
    if (id == 0 && s.kind != StateKind::kCompound) return "the root is not a compound state";
    if (id == 0 && !(s.on_entry.empty() && s.on_exit.empty())) {
      return "the root has entry or exit actions";
    }
    switch (s.kind) {
      case StateKind::kCompound:
      case StateKind::kParallel:
        if (!has_states) return fmt::format("state '{}' has no states below it", s.id);
        break;
      case StateKind::kAtomic:
      case StateKind::kFinal:
      case StateKind::kShallowHistory:
      case StateKind::kDeepHistory:
        if (!s.children.empty()) return fmt::format("state '{}' cannot have children", s.id);
        break;
    }
    if (s.kind == StateKind::kFinal && state(s.parent).kind == StateKind::kParallel) {
      return fmt::format("final state '{}' is the child of a parallel state", s.id);
    }
    if (is_history(s.kind) && s.parent == 0) {
      return fmt::format("history '{}' is a child of the root, which is never left", s.id);
    }
    if (is_history(s.kind) && !(s.on_entry.empty() && s.on_exit.empty())) {
      return fmt::format("history '{}' has entry or exit actions", s.id);
    }
    return "";
  }

  [[nodiscard]] std::string check_own_transitions(StateId id) const {
    const State& s = state(id);
    const bool may_have = id != 0 && s.kind != StateKind::kFinal && !is_history(s.kind);
    if (!may_have && !s.transitions.empty()) {
      return fmt::format("state '{}' cannot have transitions", s.id);
    }
    for (const int index : s.transitions) {
      if (!is_transition(index)) return fmt::format("a transition of '{}' does not exist", s.id);
      const Transition& t = transition(index);
      if (t.source != id) return fmt::format("a transition of '{}' has another source", s.id);
      if (t.events.empty() && t.guard < 0 && t.targets.empty()) {
        return fmt::format("a transition of '{}' has neither event, guard nor target", s.id);
      }
      for (const std::string& event : t.events) {
        if (event.empty() || event.find_first_of(" \t\r\n") != std::string::npos) {
          return fmt::format("a transition of '{}' has the event descriptor '{}'", s.id, event);
        }
      }
      if (std::string wrong = check_targets(s, t); !wrong.empty()) return wrong;
    }
    return "";
  }

  /// Any two targets lie in different regions of a parallel state, so that both can be active.
  [[nodiscard]] std::string check_targets(const State& s, const Transition& t) const {
    for (const StateId target : t.targets) {
      if (!is_state(target)) return fmt::format("a target of '{}' does not exist", s.id);
      if (target == 0) return fmt::format("a transition of '{}' targets the root", s.id);
    }
    for (std::size_t i = 0; i < t.targets.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        if (can_be_active_together(occupied(t.targets[k]), occupied(t.targets[i]))) continue;
        return fmt::format("a transition of '{}' targets '{}' and '{}', which exclude each other",
                           s.id, state(t.targets[k]).id, state(t.targets[i]).id);
      }
    }
    return "";
  }

  /// The state filled by a target: for a history, its parent.
  [[nodiscard]] StateId occupied(StateId target) const {
    return is_history(state(target).kind) ? state(target).parent : target;
  }

  [[nodiscard]] bool can_be_active_together(StateId a, StateId b) const {
    if (a == b || chart_.is_descendant(a, b) || chart_.is_descendant(b, a)) return false;
    StateId common = state(a).parent;
    while (!chart_.is_descendant(b, common)) common = state(common).parent;
    return state(common).kind == StateKind::kParallel;
  }

  [[nodiscard]] std::string check_transitions_are_listed_once() const {
    std::vector<int> listed(chart_.transitions.size(), 0);
    for (const State& s : chart_.states) {
      for (const int t : s.transitions) ++listed[static_cast<std::size_t>(t)];
      if (is_transition(s.initial)) ++listed[static_cast<std::size_t>(s.initial)];
    }
    const auto odd = std::ranges::find_if(listed, [](int times) { return times != 1; });
    if (odd == listed.end()) return "";
    return fmt::format("transition {} is listed {} times", odd - listed.begin(), *odd);
  }

  [[nodiscard]] std::string check_initial(StateId id) const {
    const State& s = state(id);
    const bool history = is_history(s.kind);
    const bool needed = history || s.kind == StateKind::kCompound;
    if (!needed) {
      return s.initial == -1 ? "" : fmt::format("state '{}' cannot have an initial state", s.id);
    }
    if (!is_transition(s.initial) || transition(s.initial).targets.empty()) {
      return fmt::format("state '{}' has no initial state", s.id);
    }
    const Transition& t = transition(s.initial);
    if (t.source != id || !t.events.empty() || t.guard >= 0 || !t.internal) {
      return fmt::format("the initial transition of '{}' is not one", s.id);
    }
    if (std::string wrong = check_targets(s, t); !wrong.empty()) return wrong;
    const StateId owner = history ? s.parent : id;
    for (const StateId target : t.targets) {
      if (!chart_.is_descendant(target, owner) || (history && is_history(state(target).kind)) ||
          (s.kind == StateKind::kShallowHistory && state(target).parent != owner)) {
        return fmt::format("'{}' cannot be an initial state of '{}'", state(target).id, s.id);
      }
    }
    return "";
  }

  const Chart& chart_;
};

}  // namespace

std::string Chart::validate() const { return Validator(*this).run(); }

}  // namespace dive::statechart
