// Names and order of the procedures are those of the recommendation's appendix D, in snake_case, so
// that the two can be compared side by side. Its lists and sets are flags per state here. The two
// deviations in behaviour, fix_domains() and complete(), are explained there.

#include "mission/statechart/interpreter.h"

#include <algorithm>
#include <utility>

#include "common/assert.h"

namespace dive::statechart {

namespace {

bool is_atomic(const State& s) {
  return s.kind == StateKind::kAtomic || s.kind == StateKind::kFinal;
}

bool is_history(const State& s) {
  return s.kind == StateKind::kShallowHistory || s.kind == StateKind::kDeepHistory;
}

}  // namespace

class Interpreter::Stepping {
 public:
  explicit Stepping(Interpreter& interpreter) : interpreter_(interpreter) {
    DIVE_DEMAND(!interpreter.stepping_);
    interpreter.stepping_ = true;
  }
  Stepping(const Stepping&) = delete;
  Stepping& operator=(const Stepping&) = delete;
  ~Stepping() { interpreter_.stepping_ = false; }

 private:
  Interpreter& interpreter_;
};

Interpreter::Interpreter(const Chart& chart, Environment& environment)
    : chart_(chart), environment_(environment) {
  DIVE_DEMAND(chart.validate().empty());
  const std::size_t count = chart.states.size();
  last_descendant_.resize(count);
  for (std::size_t s = count; s-- > 0;) {
    const State& self = chart.states[s];
    last_descendant_[s] = self.children.empty()
                              ? static_cast<StateId>(s)
                              : last_descendant_[static_cast<std::size_t>(self.children.back())];
  }
  active_.resize(count);
  history_.resize(count);
  to_exit_.resize(count);
  to_enter_.resize(count);
  default_entry_.resize(count);
  default_history_content_.resize(count, -1);
  enabled_.reserve(chart.transitions.size());
  filtered_.reserve(chart.transitions.size());
  domains_.reserve(chart.transitions.size());
}

void Interpreter::start() {
  DIVE_DEMAND(!running_);
  const Stepping stepping(*this);
  active_.assign(active_.size(), false);
  for (auto& recorded : history_) recorded.clear();
  internal_queue_.clear();
  livelocked_ = false;
  running_ = true;
  active_[0] = true;
  enabled_.assign(1, state(0).initial);
  fix_domains();
  enter_states();
  complete_macrostep();
}

void Interpreter::restore(const Memory& memory) {
  DIVE_DEMAND(!running_ && memory.history.size() == history_.size() && !memory.active.empty());
  active_.assign(active_.size(), false);
  active_[0] = true;
  for (const StateId s : memory.active) {
    DIVE_DEMAND(s > 0 && s < static_cast<StateId>(active_.size()) &&
                active_[static_cast<std::size_t>(state(s).parent)]);
    active_[static_cast<std::size_t>(s)] = true;
  }
  history_ = memory.history;
  internal_queue_.clear();
  running_ = true;
}

void Interpreter::dispatch(const std::string& event) {
  DIVE_DEMAND(!event.empty());
  if (!running_) return;
  const Stepping stepping(*this);
  if (!internal_queue_.empty()) complete_macrostep();
  if (!running_) return;
  select_transitions(event);
  if (enabled_.empty()) return;
  microstep(event);
  complete_macrostep();
}

void Interpreter::raise(std::string event) {
  DIVE_DEMAND(!event.empty());
  internal_queue_.push_back(std::move(event));
}

void Interpreter::settle() {
  if (!running_) return;
  const Stepping stepping(*this);
  complete_macrostep();
}

std::vector<StateId> Interpreter::configuration() const {
  std::vector<StateId> active;
  for (std::size_t s = 1; s < active_.size(); ++s) {
    if (active_[s]) active.push_back(static_cast<StateId>(s));
  }
  return active;
}

bool Interpreter::matches(std::string_view descriptor, std::string_view event) {
  if (descriptor == "*") return true;
  if (descriptor.ends_with(".*")) {
    descriptor.remove_suffix(2);
  } else if (descriptor.ends_with('.')) {
    descriptor.remove_suffix(1);
  }
  return event.starts_with(descriptor) &&
         (event.size() == descriptor.size() || event[descriptor.size()] == '.');
}

/// The inner loop of mainEventLoop: eventless transitions first, then internal events.
void Interpreter::complete_macrostep() {
  for (int steps = 0; running_; ++steps) {
    std::string event;
    select_eventless_transitions();
    if (enabled_.empty()) {
      if (internal_queue_.empty()) return;
      event = std::move(internal_queue_.front());
      internal_queue_.pop_front();
      select_transitions(event);
    }
    if (steps == kMaxMicrosteps) {
      livelocked_ = true;
      running_ = false;
      return;
    }
    if (!enabled_.empty()) microstep(event);
  }
}

// ---------------------------------------------------------------------------- selection

void Interpreter::select_eventless_transitions() { select_from_atomic_states(nullptr); }

void Interpreter::select_transitions(const std::string& event) {
  select_from_atomic_states(&event);
}

/// For each active atomic state in document order: the first enabled transition of that state or
/// else of its nearest ancestor that has one.
void Interpreter::select_from_atomic_states(const std::string* event) {
  enabled_.clear();
  for (StateId atomic = 1; atomic < static_cast<StateId>(active_.size()); ++atomic) {
    if (!is_active(atomic) || !is_atomic(state(atomic))) continue;
    int selected = -1;
    for (StateId s = atomic; s > 0 && selected < 0; s = state(s).parent) {
      for (const int t : state(s).transitions) {
        if (!is_enabled(transition(t), event)) continue;
        selected = t;
        break;
      }
    }
    if (selected >= 0 && std::ranges::find(enabled_, selected) == enabled_.end()) {
      enabled_.push_back(selected);
    }
  }
  remove_conflicting_transitions();
}

bool Interpreter::is_enabled(const Transition& t, const std::string* event) {
  if (event == nullptr) {
    if (!t.events.empty()) return false;
  } else if (std::ranges::none_of(t.events,
                                  [&](const std::string& e) { return matches(e, *event); })) {
    return false;
  }
  return t.guard < 0 || environment_.evaluate(t.guard);
}

/// If the exit sets of two transitions intersect, the descendant's wins, otherwise the first.
void Interpreter::remove_conflicting_transitions() {
  filtered_.clear();
  for (const int t1 : enabled_) {
    const auto conflicts = [&](int t2) {
      return exit_sets_intersect(transition(t1), transition(t2));
    };
    const bool preempted = std::ranges::any_of(filtered_, [&](int t2) {
      return conflicts(t2) && !is_descendant(transition(t1).source, transition(t2).source);
    });
    if (preempted) continue;
    std::erase_if(filtered_, conflicts);
    filtered_.push_back(t1);
  }
  enabled_.swap(filtered_);
}

/// The exit set of a transition is every active state below its domain, and a domain is always
/// active with something active below it: two sets intersect exactly if the domains nest.
bool Interpreter::exit_sets_intersect(const Transition& t1, const Transition& t2) const {
  const StateId domain1 = transition_domain(t1);
  const StateId domain2 = transition_domain(t2);
  if (domain1 < 0 || domain2 < 0) return false;
  return domain1 == domain2 || is_descendant(domain1, domain2) || is_descendant(domain2, domain1);
}

// ---------------------------------------------------------------------------- microstep

void Interpreter::microstep(const std::string& event) {
  for (const int t : enabled_) environment_.taken(t, event);
  fix_domains();
  exit_states();
  for (const int t : enabled_) {
    for (const ActionId action : transition(t).actions) environment_.execute(action);
  }
  enter_states();
}

/// Appendix D computes the domain again for the entry set. By then the exits may have recorded the
/// history that the transition targets, the domain may have become smaller, and states exited above
/// it would never be entered again. Therefore it is computed once, before any exit.
void Interpreter::fix_domains() {
  domains_.clear();
  for (const int t : enabled_) domains_.push_back(transition_domain(transition(t)));
}

void Interpreter::exit_states() {
  compute_exit_set();
  for (StateId s = last_descendant_[0]; s > 0; --s) {
    if (to_exit_[static_cast<std::size_t>(s)]) record_history(s);
  }
  for (StateId s = last_descendant_[0]; s > 0; --s) {
    if (!to_exit_[static_cast<std::size_t>(s)]) continue;
    environment_.exited(s);
    for (const ActionId action : state(s).on_exit) environment_.execute(action);
    active_[static_cast<std::size_t>(s)] = false;
  }
}

void Interpreter::compute_exit_set() {
  to_exit_.assign(to_exit_.size(), false);
  for (const StateId domain : domains_) {
    if (domain < 0) continue;
    for (StateId s = domain + 1; s <= last_descendant_[static_cast<std::size_t>(domain)]; ++s) {
      if (is_active(s)) to_exit_[static_cast<std::size_t>(s)] = true;
    }
  }
}

void Interpreter::record_history(StateId exited) {
  for (const StateId h : state(exited).children) {
    if (!is_history(state(h))) continue;
    const bool deep = state(h).kind == StateKind::kDeepHistory;
    auto& recorded = history_[static_cast<std::size_t>(h)];
    recorded.clear();
    for (StateId s = exited + 1; s <= last_descendant_[static_cast<std::size_t>(exited)]; ++s) {
      const bool wanted = deep ? is_atomic(state(s)) : state(s).parent == exited;
      if (is_active(s) && wanted) recorded.push_back(s);
    }
  }
}

void Interpreter::enter_states() {
  to_enter_.assign(to_enter_.size(), false);
  default_entry_.assign(default_entry_.size(), false);
  default_history_content_.assign(default_history_content_.size(), -1);
  for (std::size_t i = 0; i < enabled_.size(); ++i) {
    compute_entry_set(transition(enabled_[i]), domains_[i]);
  }
  for (StateId s = 1; s <= last_descendant_[0]; ++s) {
    if (to_enter_[static_cast<std::size_t>(s)]) enter(s);
  }
}

void Interpreter::enter(StateId s) {
  const auto execute = [this](const std::vector<ActionId>& actions) {
    for (const ActionId action : actions) environment_.execute(action);
  };
  active_[static_cast<std::size_t>(s)] = true;
  execute(state(s).on_entry);
  if (default_entry_[static_cast<std::size_t>(s)]) execute(transition(state(s).initial).actions);
  const int history = default_history_content_[static_cast<std::size_t>(s)];
  if (history >= 0) execute(transition(history).actions);
  environment_.entered(s);
  if (state(s).kind == StateKind::kFinal) complete(s);
}

/// A final state completes its parent, and the parent completes the parallel state around it once
/// all regions are complete. Appendix D stops there; by 3.4 the completion of a parallel state that
/// is itself a region may complete the next one, so this loop continues upwards.
void Interpreter::complete(StateId final_state) {
  const StateId parent = state(final_state).parent;
  if (parent == 0) {
    running_ = false;
    return;
  }
  raise("done.state." + state(parent).id);
  for (StateId p = state(parent).parent; p > 0; p = state(p).parent) {
    if (state(p).kind != StateKind::kParallel || !is_in_final_state(p)) return;
    raise("done.state." + state(p).id);
  }
}

bool Interpreter::is_in_final_state(StateId s) const {
  const auto& children = state(s).children;
  switch (state(s).kind) {
    case StateKind::kCompound:
      return std::ranges::any_of(children, [this](StateId child) {
        return state(child).kind == StateKind::kFinal && is_active(child);
      });
    case StateKind::kParallel:
      return std::ranges::all_of(children, [this](StateId child) {
        return is_history(state(child)) || is_in_final_state(child);
      });
    default:
      return false;
  }
}

// ---------------------------------------------------------------------------- entry set

void Interpreter::compute_entry_set(const Transition& t, StateId domain) {
  for (const StateId s : t.targets) add_descendant_states_to_enter(s);
  (void)every_effective_target(t, [&](StateId s) {
    add_ancestor_states_to_enter(s, domain);
    return true;
  });
}

void Interpreter::add_descendant_states_to_enter(StateId s) {
  if (is_history(state(s))) {
    const StateId parent = state(s).parent;
    if (history_[static_cast<std::size_t>(s)].empty()) {
      default_history_content_[static_cast<std::size_t>(parent)] = state(s).initial;
    }
    for (const StateId target : recorded_or_default(s)) add_descendant_states_to_enter(target);
    for (const StateId target : recorded_or_default(s)) {
      add_ancestor_states_to_enter(target, parent);
    }
    return;
  }
  to_enter_[static_cast<std::size_t>(s)] = true;
  if (state(s).kind == StateKind::kCompound) {
    default_entry_[static_cast<std::size_t>(s)] = true;
    const auto& targets = transition(state(s).initial).targets;
    for (const StateId target : targets) add_descendant_states_to_enter(target);
    for (const StateId target : targets) add_ancestor_states_to_enter(target, s);
  } else if (state(s).kind == StateKind::kParallel) {
    add_regions_to_enter(s);
  }
}

void Interpreter::add_ancestor_states_to_enter(StateId s, StateId ancestor) {
  for (StateId a = state(s).parent; a > 0 && a != ancestor; a = state(a).parent) {
    to_enter_[static_cast<std::size_t>(a)] = true;
    if (state(a).kind == StateKind::kParallel) add_regions_to_enter(a);
  }
}

/// Enters by default every region of a parallel state that no target has entered.
void Interpreter::add_regions_to_enter(StateId parallel) {
  for (const StateId child : state(parallel).children) {
    if (!is_history(state(child)) && !enters_below(child)) add_descendant_states_to_enter(child);
  }
}

bool Interpreter::enters_below(StateId s) const {
  for (StateId d = s + 1; d <= last_descendant_[static_cast<std::size_t>(s)]; ++d) {
    if (to_enter_[static_cast<std::size_t>(d)]) return true;
  }
  return false;
}

// ---------------------------------------------------------------------------- domain

std::span<const StateId> Interpreter::recorded_or_default(StateId history) const {
  const auto& recorded = history_[static_cast<std::size_t>(history)];
  return recorded.empty() ? transition(state(history).initial).targets : recorded;
}

/// getEffectiveTargetStates, without the list: a history is replaced by the states it would
/// restore.
template <typename Predicate>
bool Interpreter::every_effective_target(const Transition& t, Predicate predicate) const {
  return std::ranges::all_of(t.targets, [&](StateId target) {
    if (!is_history(state(target))) return predicate(target);
    return std::ranges::all_of(recorded_or_default(target), predicate);
  });
}

/// The domain of the transition: active states below it are exited, and it stays active itself. -1
/// for a targetless transition.
StateId Interpreter::transition_domain(const Transition& t) const {
  if (t.targets.empty()) return -1;
  const auto below_source = [&](StateId target) { return is_descendant(target, t.source); };
  if (t.internal && state(t.source).kind == StateKind::kCompound &&
      every_effective_target(t, below_source)) {
    return t.source;
  }
  return find_lcca(t);
}

/// Least common compound ancestor of source and effective targets; at most the root.
StateId Interpreter::find_lcca(const Transition& t) const {
  for (StateId a = state(t.source).parent; a > 0; a = state(a).parent) {
    if (state(a).kind == StateKind::kCompound &&
        every_effective_target(t, [&](StateId target) { return is_descendant(target, a); })) {
      return a;
    }
  }
  return 0;
}

}  // namespace dive::statechart
