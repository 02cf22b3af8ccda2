#include "test/mission/statechart/reference_interpreter.h"

#include <algorithm>
#include <sstream>

namespace dive::statechart::testing {

bool ReferenceInterpreter::is_history(int s) const {
  return state(s).kind == StateKind::kShallowHistory || state(s).kind == StateKind::kDeepHistory;
}
bool ReferenceInterpreter::is_compound_or_scxml(int s) const {
  return s == 0 || state(s).kind == StateKind::kCompound;
}
bool ReferenceInterpreter::is_parallel(int s) const {
  return state(s).kind == StateKind::kParallel;
}

ReferenceInterpreter::Set ReferenceInterpreter::get_child_states(int s) const {
  Set found;
  for (int c = 0; c < static_cast<int>(doc_.states.size()); ++c) {
    if (state(c).parent == s && !is_history(c)) found.push_back(c);
  }
  return found;
}

bool ReferenceInterpreter::is_descendant(int s1, int s2) const {
  if (state(s1).parent < 0) return false;
  return state(s1).parent == s2 || is_descendant(state(s1).parent, s2);
}

/// s2 = -1: up to and including the <scxml> element.
ReferenceInterpreter::Set ReferenceInterpreter::get_proper_ancestors(int s1, int s2) const {
  Set found;
  for (int a = state(s1).parent; a >= 0; a = state(a).parent) {
    if (a == s2) return found;
    found.push_back(a);
  }
  return s2 < 0 ? found : Set{};
}

void ReferenceInterpreter::add(Set& set, int element) {
  if (std::count(set.begin(), set.end(), element) == 0) set.push_back(element);
}

bool ReferenceInterpreter::name_match(const std::string& descriptor, const std::string& event) {
  std::istringstream wanted(descriptor);
  std::istringstream given(event);
  for (std::string token; std::getline(wanted, token, '.');) {
    if (token == "*") return true;
    std::string other;
    if (!std::getline(given, other, '.') || other != token) return false;
  }
  return true;
}

void ReferenceInterpreter::interpret() {
  running_ = true;
  configuration_.insert(0);
  domain_[state(0).initial] = 0;
  enter_states({state(0).initial});
  run_to_completion();
}

void ReferenceInterpreter::external_event(const std::string& event) {
  if (!running_) return;
  const Set enabled = select_transitions(&event);
  if (!enabled.empty()) {
    microstep(enabled, event);
    run_to_completion();
  }
}

void ReferenceInterpreter::run_to_completion() {
  bool macrostep_done = false;
  int microsteps = 0;
  while (running_ && !macrostep_done) {
    std::string event;
    Set enabled = select_transitions(nullptr);
    if (enabled.empty()) {
      if (internal_queue_.empty()) {
        macrostep_done = true;
        continue;
      }
      event = internal_queue_.front();
      internal_queue_.pop_front();
      enabled = select_transitions(&event);
    }
    if (++microsteps > max_microsteps_) {
      livelocked_ = true;
      running_ = false;
      return;
    }
    if (!enabled.empty()) microstep(enabled, event);
  }
}

ReferenceInterpreter::Set ReferenceInterpreter::select_transitions(const std::string* event) {
  const auto selects = [&](int s) {
    for (const int t : state(s).transitions) {
      const auto& events = transition(t).events;
      const bool named = event == nullptr
                             ? events.empty()
                             : std::any_of(events.begin(), events.end(),
                                           [&](const auto& e) { return name_match(e, *event); });
      if (named && (transition(t).guard < 0 || environment_.evaluate(transition(t).guard))) {
        return t;
      }
    }
    return -1;
  };
  Set enabled;
  for (const int atomic : configuration_) {
    if (!get_child_states(atomic).empty()) continue;
    Set path = get_proper_ancestors(atomic, -1);
    path.insert(path.begin(), atomic);
    for (const int s : path) {
      const int t = selects(s);
      if (t < 0) continue;
      add(enabled, t);
      break;
    }
  }
  return remove_conflicting(enabled);
}

ReferenceInterpreter::Set ReferenceInterpreter::remove_conflicting(const Set& enabled) {
  Set filtered;
  for (const int t1 : enabled) {
    bool t1_preempted = false;
    Set to_remove;
    for (const int t2 : filtered) {
      const std::set<int> exit1 = compute_exit_set({t1});
      const std::set<int> exit2 = compute_exit_set({t2});
      const bool intersect =
          std::any_of(exit1.begin(), exit1.end(), [&](int s) { return exit2.count(s) > 0; });
      if (!intersect) continue;
      if (is_descendant(transition(t1).source, transition(t2).source)) {
        add(to_remove, t2);
      } else {
        t1_preempted = true;
        break;
      }
    }
    if (t1_preempted) continue;
    for (const int t3 : to_remove) filtered.erase(std::find(filtered.begin(), filtered.end(), t3));
    add(filtered, t1);
  }
  return filtered;
}

void ReferenceInterpreter::microstep(const Set& enabled, const std::string& event) {
  for (const int t : enabled) environment_.taken(t, event);
  // Before the exits record history, not during the entry as in appendix D: see the test
  // History.RecordedOnExitDoesNotMoveTheDomain.
  domain_.clear();
  for (const int t : enabled) domain_[t] = get_transition_domain(t);
  exit_states(enabled);
  for (const int t : enabled) {
    for (const int a : transition(t).actions) environment_.execute(a);
  }
  enter_states(enabled);
}

std::set<int> ReferenceInterpreter::compute_exit_set(const Set& transitions) {
  std::set<int> to_exit;
  for (const int t : transitions) {
    if (transition(t).targets.empty()) continue;
    const int domain = get_transition_domain(t);
    for (const int s : configuration_) {
      if (is_descendant(s, domain)) to_exit.insert(s);
    }
  }
  return to_exit;
}

void ReferenceInterpreter::exit_states(const Set& enabled) {
  const std::set<int> to_exit = compute_exit_set(enabled);
  const Set exit_order(to_exit.rbegin(), to_exit.rend());
  for (const int s : exit_order) {
    for (const int h : state(s).children) {
      if (!is_history(h)) continue;
      Set value;
      for (const int s0 : configuration_) {
        const bool keep = state(h).kind == StateKind::kDeepHistory
                              ? get_child_states(s0).empty() && is_descendant(s0, s)
                              : state(s0).parent == s;
        if (keep) value.push_back(s0);
      }
      history_value_[h] = value;
    }
  }
  for (const int s : exit_order) {
    environment_.exited(s);
    for (const int a : state(s).on_exit) environment_.execute(a);
    configuration_.erase(s);
  }
}

void ReferenceInterpreter::enter_states(const Set& enabled) {
  states_to_enter_.clear();
  states_for_default_entry_.clear();
  default_history_content_.clear();
  for (const int t : enabled) {
    for (const int s : transition(t).targets) add_descendants(s);
    const int ancestor = domain_[t];
    for (const int s : get_effective_target_states(t)) add_ancestors(s, ancestor);
  }
  const std::set<int> entry_order = states_to_enter_;
  for (const int s : entry_order) {
    configuration_.insert(s);
    for (const int a : state(s).on_entry) environment_.execute(a);
    if (states_for_default_entry_.count(s) > 0) {
      for (const int a : transition(state(s).initial).actions) environment_.execute(a);
    }
    if (default_history_content_.count(s) > 0) {
      for (const int a : transition(default_history_content_[s]).actions) environment_.execute(a);
    }
    environment_.entered(s);
    if (state(s).kind != StateKind::kFinal) continue;
    const int parent = state(s).parent;
    if (parent == 0) {
      running_ = false;
      continue;
    }
    enqueue("done.state." + state(parent).id);
    // Section 3.4, not appendix D: a completed region may itself be a parallel state.
    int around = state(parent).parent;
    while (is_parallel(around) && is_in_final_state(around)) {
      enqueue("done.state." + state(around).id);
      around = state(around).parent;
    }
  }
}

bool ReferenceInterpreter::is_in_final_state(int s) const {
  const Set children = get_child_states(s);
  if (is_parallel(s)) {
    return std::all_of(children.begin(), children.end(),
                       [&](int c) { return is_in_final_state(c); });
  }
  return is_compound_or_scxml(s) && std::any_of(children.begin(), children.end(), [&](int c) {
           return state(c).kind == StateKind::kFinal && configuration_.count(c) > 0;
         });
}

void ReferenceInterpreter::add_descendants(int s) {
  if (is_history(s)) {
    Set value;
    if (history_value_.count(s) > 0) {
      value = history_value_[s];
    } else {
      default_history_content_[state(s).parent] = state(s).initial;
      value = transition(state(s).initial).targets;
    }
    for (const int v : value) add_descendants(v);
    for (const int v : value) add_ancestors(v, state(s).parent);
    return;
  }
  states_to_enter_.insert(s);
  if (is_compound_or_scxml(s)) {
    states_for_default_entry_.insert(s);
    for (const int i : transition(state(s).initial).targets) add_descendants(i);
    for (const int i : transition(state(s).initial).targets) add_ancestors(i, s);
  } else if (is_parallel(s)) {
    add_missing_regions(s);
  }
}

void ReferenceInterpreter::add_ancestors(int s, int ancestor) {
  for (const int a : get_proper_ancestors(s, ancestor)) {
    states_to_enter_.insert(a);
    if (is_parallel(a)) add_missing_regions(a);
  }
}

void ReferenceInterpreter::add_missing_regions(int s) {
  for (const int child : get_child_states(s)) {
    const bool there = std::any_of(states_to_enter_.begin(), states_to_enter_.end(),
                                   [&](int e) { return is_descendant(e, child); });
    if (!there) add_descendants(child);
  }
}

ReferenceInterpreter::Set ReferenceInterpreter::get_effective_target_states(int t) const {
  Set targets;
  for (const int s : transition(t).targets) {
    if (!is_history(s)) {
      add(targets, s);
    } else if (history_value_.count(s) > 0) {
      for (const int v : history_value_.at(s)) add(targets, v);
    } else {
      for (const int v : get_effective_target_states(state(s).initial)) add(targets, v);
    }
  }
  return targets;
}

int ReferenceInterpreter::get_transition_domain(int t) const {
  Set targets = get_effective_target_states(t);
  const int source = transition(t).source;
  const bool inside =
      std::all_of(targets.begin(), targets.end(), [&](int s) { return is_descendant(s, source); });
  if (transition(t).internal && is_compound_or_scxml(source) && inside) return source;
  targets.insert(targets.begin(), source);
  return find_lcca(targets);
}

int ReferenceInterpreter::find_lcca(const Set& list) const {
  for (const int a : get_proper_ancestors(list.front(), -1)) {
    if (!is_compound_or_scxml(a)) continue;
    if (std::all_of(list.begin() + 1, list.end(), [&](int s) { return is_descendant(s, a); })) {
      return a;
    }
  }
  return 0;
}

}  // namespace dive::statechart::testing
