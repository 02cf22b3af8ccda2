#include "mission/executive/machine.h"

#include <utility>

#include "common/assert.h"
#include "mission/states/hold.h"
#include "mission/states/retrace.h"
#include "mission/states/surface.h"

namespace dive::mission {
namespace {

using statechart::StateId;
using statechart::StateKind;
using statechart::Transition;

constexpr double kRetraceWait = 60.0;  // s in open water before a retrace ends in surfacing

StateKind kind_of(StateType type) {
  switch (type) {
    case StateType::kCompound:
      return StateKind::kCompound;
    case StateType::kParallel:
      return StateKind::kParallel;
    case StateType::kFinal:
      return StateKind::kFinal;
    case StateType::kShallowHistory:
      return StateKind::kShallowHistory;
    case StateType::kDeepHistory:
      return StateKind::kDeepHistory;
    case StateType::kAtomic:
      return StateKind::kAtomic;
  }
  DIVE_DEMAND(false);
}

class Builder {
 public:
  explicit Builder(const Mission& mission) : mission_(mission) {}

  Machine build() {
    const StateId root = add("dive", StateKind::kCompound, -1, nullptr);
    for (const StateSpec& spec : mission_.states) add_tree(spec, root);
    add_own_states(root);
    // All states exist now, so that targets can be found.
    for (const StateSpec& spec : mission_.states) add_takeovers(spec);
    for (const StateSpec& spec : mission_.states) add_transitions(spec);
    machine_.chart.set_initial(root, {find(mission_.initial.value)});
    return std::move(machine_);
  }

 private:
  StateId add(const std::string& id, StateKind kind, StateId parent, const StateSpec* spec) {
    const StateId state = machine_.chart.add_state(id, kind, parent);
    machine_.specs.push_back(spec);
    machine_.atomic.push_back(spec != nullptr ? spec->atomic : nullptr);
    return state;
  }

  StateId add_own_atomic(const std::string& id, StateId parent,
                         std::shared_ptr<const AtomicState> atomic) {
    const StateId state = add(id, StateKind::kAtomic, parent, nullptr);
    machine_.atomic.back() = std::move(atomic);
    return state;
  }

  StateId find(const std::string& id) const {
    const StateId state = machine_.chart.find(id);
    DIVE_DEMAND(state >= 0);  // load_mission() has checked it
    return state;
  }

  void add_tree(const StateSpec& spec, StateId parent) {
    const StateId state = add(spec.id.value, kind_of(spec.type), parent, &spec);
    for (const StateSpec& child : spec.children) add_tree(child, state);
  }

  void add_own_states(StateId root) {
    const StateId retrace = add(kRetraceState, StateKind::kCompound, root, nullptr);
    const StateId path =
        add_own_atomic(kRetracePathState, retrace, std::make_shared<RetraceState>());
    const StateId wait = add_own_atomic(
        kRetraceWaitState, retrace, std::make_shared<HoldState>(Located<double>{kRetraceWait, {}}));
    const StateId abort = add(kAbortState, StateKind::kCompound, root, nullptr);
    const StateId abort_retrace =
        add_own_atomic(kAbortRetraceState, abort, std::make_shared<RetraceState>());
    const StateId abort_surface =
        add_own_atomic(kAbortSurfaceState, abort, std::make_shared<SurfaceState>());
    const StateId emergency = add_own_atomic(
        kEmergencyState, root, std::make_shared<SurfaceState>(SurfaceState::Obstacles::kIgnored));
    const StateId aborted = add(kAbortedState, StateKind::kFinal, root, nullptr);
    machine_.chart.set_initial(retrace, {path});
    on(path, done_event(kRetracePathState), wait);
    on(wait, done_event(kRetraceWaitState), abort);
    on(retrace, kAbortEvent, abort);
    on(retrace, kEmergencyEvent, emergency);
    machine_.chart.set_initial(abort, {abort_retrace});
    on(abort_retrace, done_event(kAbortRetraceState), abort_surface);
    on(abort_surface, done_event(kAbortSurfaceState), aborted);
    on(emergency, done_event(kEmergencyState), aborted);
    on(abort, kEmergencyEvent, emergency);
  }

  static std::string done_event(const std::string& id) { return "done.state." + id; }

  void on(StateId source, const std::string& event, StateId target) {
    Transition transition;
    transition.source = source;
    transition.events = {event};
    transition.targets = {target};
    machine_.chart.add_transition(std::move(transition));
  }

  void add_transitions(const StateSpec& spec) {
    const StateId source = find(spec.id.value);
    set_initial(spec, source);
    if (spec.timeout) {
      on(source, "timeout." + spec.id.value, find(spec.timeout->on_timeout.value));
    }
    statechart::State& state = machine_.chart.states[static_cast<std::size_t>(source)];
    state.on_entry = add_actions(spec.on_entry);
    state.on_exit = add_actions(spec.on_exit);
    for (const TransitionSpec& written : spec.transitions) {
      Transition transition;
      transition.source = source;
      transition.events = written.events;
      transition.internal = written.internal;
      transition.actions = add_actions(written.actions);
      for (const auto& target : written.targets) transition.targets.push_back(find(target.value));
      if (written.guard) {
        transition.guard = static_cast<int>(machine_.guards.size());
        machine_.guards.push_back(*written.guard);
      }
      machine_.chart.add_transition(std::move(transition));
    }
    for (const StateSpec& child : spec.children) add_transitions(child);
  }

  std::vector<statechart::ActionId> add_actions(const std::vector<ActionSpec>& written) {
    std::vector<statechart::ActionId> ids;
    for (const ActionSpec& action : written) {
      ids.push_back(static_cast<statechart::ActionId>(machine_.actions.size()));
      machine_.actions.push_back(action);
    }
    return ids;
  }

  void set_initial(const StateSpec& spec, StateId state) {
    if (spec.initial) {
      machine_.chart.set_initial(state, {find(spec.initial->value)});
    } else if (spec.type == StateType::kCompound) {
      machine_.chart.set_initial(state, {find(spec.children.front().id.value)});
    }
  }

  // In every state that can be active, before the mission's own transitions: inner transitions come
  // before outer ones, and a mission's "*" matches these events too.
  void add_takeovers(const StateSpec& spec) {
    if (spec.type == StateType::kFinal || is_history(spec)) return;
    const StateId source = find(spec.id.value);
    on(source, kRetraceEvent, find(kRetraceState));
    on(source, kAbortEvent, find(kAbortState));
    on(source, kEmergencyEvent, find(kEmergencyState));
    for (const StateSpec& child : spec.children) add_takeovers(child);
  }

  const Mission& mission_;
  Machine machine_;
};

}  // namespace

Machine build_machine(const Mission& mission) {
  Machine machine = Builder(mission).build();
  DIVE_DEMAND(machine.chart.validate().empty());
  return machine;
}

}  // namespace dive::mission
