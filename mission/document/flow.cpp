#include "mission/document/flow.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

namespace dive::mission {
namespace {

void sort_out(std::vector<int>& states) {
  std::sort(states.begin(), states.end());
  states.erase(std::unique(states.begin(), states.end()), states.end());
}

bool raises(const StateSpec& spec, const std::string& event) {
  const std::vector<const ActionSpec*> actions = actions_of(spec);
  return std::any_of(actions.begin(), actions.end(), [&event](const ActionSpec* action) {
    return action->kind == ActionSpec::Kind::kRaise && action->text.value == event;
  });
}

}  // namespace

Flow::Flow(const Mission& mission, const StateIndex& index)
    : index_(index),
      arcs_of_(cast(index.size())),
      arcs_from_(cast(index.size())),
      entered_(cast(index.size()), false) {
  land(index.find(mission.initial.value), first_);
  for (int state = 0; state < index.size(); ++state) {
    add_arcs(state);
    done_may_be_late_ |= index.spec(state).type == StateType::kParallel;
  }
  // Transitions of the atomic state itself cannot precede the completion of a final state's parent.
  done_may_be_late_ |= std::any_of(arcs_.begin(), arcs_.end(), [this](const Arc& arc) {
    return arc.spec != nullptr && arc.spec->events.empty() &&
           index_.spec(arc.owner).type != StateType::kAtomic;
  });
  for (int state = 0; state < index.size(); ++state) {
    const StateType type = index.spec(state).type;
    if (type == StateType::kAtomic || type == StateType::kFinal) find_arcs_from(state);
  }
  enter_from_the_beginning();
}

void Flow::add_arcs(int state) {
  const StateSpec& spec = index_.spec(state);
  const auto add = [&](Arc arc) {
    arc.owner = state;
    sort_out(arc.lands);
    sort_out(arc.returns);
    arcs_of_[cast(state)].push_back(static_cast<int>(arcs_.size()));
    arcs_.push_back(std::move(arc));
  };
  if (const Timeout* timeout = state_timeout(spec)) {
    Arc arc;
    arc.triggers = {{Trigger::Kind::kTimeout, state}};
    land(index_.find(timeout->on_timeout.value), arc);
    add(std::move(arc));
  }
  for (const TransitionSpec& transition : spec.transitions) {
    Arc arc;
    arc.spec = &transition;
    for (const std::string& event : transition.events) arc.triggers.push_back(trigger(event));
    if (arc.triggers.empty()) arc.triggers.push_back({Trigger::Kind::kAlways, -1});
    for (const auto& target : transition.targets) land(index_.find(target.value), arc);
    arc.only_emergency = std::all_of(
        arc.triggers.begin(), arc.triggers.end(),
        [](const Trigger& trigger) { return trigger.kind == Trigger::Kind::kEmergency; });
    add(std::move(arc));
  }
}

Flow::Trigger Flow::trigger(std::string_view descriptor) const {
  if (descriptor == "*") return {Trigger::Kind::kAlways, -1};
  if (descriptor.ends_with(".*")) descriptor.remove_suffix(2);
  constexpr std::pair<std::string_view, Trigger::Kind> kFamilies[] = {
      {"done.state.", Trigger::Kind::kDone},
      {"plan.failed.", Trigger::Kind::kPlanFailed},
      {"timeout.", Trigger::Kind::kTimeout},
  };
  for (const auto& [family, kind] : kFamilies) {
    if (descriptor.starts_with(family)) {
      return {kind, index_.find(std::string(descriptor.substr(family.size())))};
    }
    // A prefix of the family represents the whole family.
    if (family.starts_with(descriptor)) return {kind, -1};
  }
  const std::set<std::string> raised = raised_events(index_);
  if (std::any_of(raised.begin(), raised.end(), [descriptor](const std::string& event) {
        return event == descriptor || event.starts_with(std::string(descriptor) + ".");
      })) {
    return {Trigger::Kind::kAlways, -1};
  }
  return {Trigger::Kind::kEmergency, -1};  // every event belongs to one of the two families
}

// A target also enters the default of every parallel region beside it.
void Flow::land(int target, Arc& arc) const {
  land_inside(target, arc);
  for (int inner = target, s = index_.parent(target); s >= 0; inner = s, s = index_.parent(s)) {
    if (index_.spec(s).type != StateType::kParallel) continue;
    for (const int region : index_.children(s)) {
      if (region != inner && !is_history(index_.spec(region))) land_inside(region, arc);
    }
  }
}

void Flow::land_inside(int state, Arc& arc) const {
  const StateSpec& spec = index_.spec(state);
  switch (spec.type) {
    case StateType::kAtomic:
    case StateType::kFinal:
      arc.lands.push_back(state);
      return;
    case StateType::kCompound:
      land_inside(index_.find(spec.initial->value), arc);
      return;
    case StateType::kParallel:
      for (const int region : index_.children(state)) {
        if (!is_history(index_.spec(region))) land_inside(region, arc);
      }
      return;
    case StateType::kShallowHistory:
    case StateType::kDeepHistory:
      land_in_history(state, arc);
      return;
  }
}

void Flow::land_in_history(int state, Arc& arc) const {
  arc.histories.push_back(state);
  const int parent = index_.parent(state);
  for (int inside = parent; inside < index_.size() && index_.is_within(inside, parent); ++inside) {
    const StateType type = index_.spec(inside).type;
    if (type == StateType::kAtomic || type == StateType::kFinal) arc.returns.push_back(inside);
  }
  land_inside(index_.find(index_.spec(state).initial->value), arc);
}

// While a state within a parallel is active, all others within it may be active too.
void Flow::find_arcs_from(int state) {
  const int parallel = index_.outermost_parallel(state);
  std::vector<int>& from = arcs_from_[cast(state)];
  const auto consider = [&](int owner) {
    for (const int arc : arcs_of_[cast(owner)]) {
      const std::vector<Trigger>& triggers = arcs_[cast(arc)].triggers;
      if (std::any_of(triggers.begin(), triggers.end(), [&](const Trigger& trigger) {
            return may_happen(trigger, state, parallel);
          })) {
        from.push_back(arc);
      }
    }
  };
  int outside = state;
  if (parallel >= 0) {
    for (int s = parallel; s < index_.size() && index_.is_within(s, parallel); ++s) consider(s);
    outside = index_.parent(parallel);
  }
  for (int s = outside; s >= 0; s = index_.parent(s)) consider(s);
}

// For the active atomic or final `state`, in the outermost `parallel` or in none.
bool Flow::may_happen(const Trigger& trigger, int state, int parallel) const {
  using Kind = Trigger::Kind;
  if (trigger.kind == Kind::kAlways || trigger.kind == Kind::kEmergency) return true;
  const bool of_whole = trigger.state >= 0 && index_.spec(trigger.state).type != StateType::kAtomic;
  if (done_may_be_late_ && trigger.kind == Kind::kDone && (trigger.state < 0 || of_whole)) {
    return true;
  }
  if (parallel >= 0) return trigger.state < 0 || index_.is_within(trigger.state, parallel);
  if (trigger.kind == Kind::kTimeout) {
    for (int s = state; s >= 0; s = index_.parent(s)) {
      if ((trigger.state < 0 || trigger.state == s) && state_timeout(index_.spec(s))) return true;
    }
    return false;
  }
  // A failure of a planning state that is part of a composite is raised for the composite.
  if (trigger.kind == Kind::kPlanFailed && of_whole) {
    return raises(index_.spec(state), "plan.failed." + index_.spec(trigger.state).id.value);
  }
  // Outside of parallels only the atomic state itself is done, or the state that its final state
  // completes.
  const StateSpec& spec = index_.spec(state);
  const int source = spec.type == StateType::kFinal ? index_.parent(state) : state;
  if (source < 0 || (trigger.state >= 0 && trigger.state != source)) return false;
  if (spec.type == StateType::kFinal) return trigger.kind == Kind::kDone;
  return trigger.kind == Kind::kDone ? is_behavior(spec) : is_planning(spec);
}

void Flow::enter_from_the_beginning() {
  std::vector<int> pending;
  std::vector<bool> followed(arcs_.size(), false);
  enter(first_, pending);
  do {
    while (!pending.empty()) {
      const int state = pending.back();
      pending.pop_back();
      for (const int arc : arcs_from(state)) {
        if (followed[cast(arc)]) continue;
        followed[cast(arc)] = true;
        enter(arcs_[cast(arc)], pending);
      }
    }
    bring_back(pending);
  } while (!pending.empty());
}

// A shallow history restores a child that was entered before, perhaps by a target inside it; now
// the child is entered by its defaults. Every state that a deep history restores was entered
// before.
void Flow::bring_back(std::vector<int>& pending) {
  for (int state = 0; state < index_.size(); ++state) {
    if (!entered(state) || index_.spec(state).type != StateType::kShallowHistory) continue;
    for (const int beside : index_.children(index_.parent(state))) {
      if (!entered(beside) || is_history(index_.spec(beside))) continue;
      Arc back;
      land_inside(beside, back);
      enter(back, pending);
    }
  }
}

void Flow::enter(const Arc& arc, std::vector<int>& pending) {
  for (const int history : arc.histories) entered_[cast(history)] = true;
  for (const int leaf : arc.lands) {
    if (entered_[cast(leaf)]) continue;
    pending.push_back(leaf);
    for (int s = leaf; s >= 0; s = index_.parent(s)) entered_[cast(s)] = true;
  }
}

std::vector<bool> Flow::ends() const {
  std::vector<bool> ends;
  for (int state = 0; state < index_.size(); ++state) {
    ends.push_back(index_.spec(state).type == StateType::kFinal && index_.parent(state) < 0);
  }
  return ends;
}

std::vector<bool> Flow::can_reach(const std::vector<bool>& goals) const {
  std::vector<std::vector<int>> landing(cast(index_.size()));  // arcs by the states they enter
  // atomic states by the arcs they may follow
  std::vector<std::vector<int>> sources(arcs_.size());
  for (std::size_t a = 0; a < arcs_.size(); ++a) {
    for (const int to : arcs_[a].lands) landing[cast(to)].push_back(static_cast<int>(a));
    for (const int to : arcs_[a].returns) landing[cast(to)].push_back(static_cast<int>(a));
  }
  std::vector<bool> can(goals);
  std::vector<int> pending;
  for (int state = 0; state < index_.size(); ++state) {
    for (const int arc : arcs_from(state)) sources[cast(arc)].push_back(state);
    if (goals[cast(state)]) pending.push_back(state);
  }
  std::vector<bool> seen(arcs_.size(), false);
  while (!pending.empty()) {
    const int state = pending.back();
    pending.pop_back();
    for (const int arc : landing[cast(state)]) {
      if (seen[cast(arc)] || arcs_[cast(arc)].only_emergency) continue;
      seen[cast(arc)] = true;
      for (const int source : sources[cast(arc)]) {
        if (can[cast(source)]) continue;
        can[cast(source)] = true;
        pending.push_back(source);
      }
    }
  }
  return can;
}

std::vector<bool> Flow::reached_without(const std::vector<bool>& avoid) const {
  std::vector<bool> reached(cast(index_.size()), false);
  std::vector<int> pending;
  const auto reach = [&](const std::vector<int>& leaves) {
    for (const int leaf : leaves) {
      if (reached[cast(leaf)] || avoid[cast(leaf)]) continue;
      reached[cast(leaf)] = true;
      pending.push_back(leaf);
    }
  };
  std::vector<bool> followed(arcs_.size(), false);
  reach(first_.lands);
  while (!pending.empty()) {
    const int state = pending.back();
    pending.pop_back();
    for (const int arc : arcs_from(state)) {
      if (followed[cast(arc)] || arcs_[cast(arc)].only_emergency) continue;
      followed[cast(arc)] = true;
      reach(arcs_[cast(arc)].lands);
      reach(arcs_[cast(arc)].returns);
    }
  }
  return reached;
}

}  // namespace dive::mission
