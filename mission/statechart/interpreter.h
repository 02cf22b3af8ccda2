#pragma once
// The SCXML algorithm (W3C Recommendation, appendix D), procedure by procedure: selection by
// document order with preemption of conflicting transitions, exit and entry sets by the transition
// domain (least common compound ancestor), run to completion, done.state.ID events, history.

#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mission/statechart/chart.h"

namespace dive::statechart {

/// The effects of a chart, defined by its user.
class Environment {
 public:
  virtual ~Environment() = default;
  [[nodiscard]] virtual bool evaluate(GuardId guard) = 0;
  virtual void execute(ActionId action) = 0;
  /// Called after the on_entry actions of the state.
  virtual void entered(StateId state) = 0;
  /// Called before the on_exit actions of the state.
  virtual void exited(StateId state) = 0;
  /// A transition was selected in a microstep; called before any state is exited. `event` is empty
  /// for eventless transitions.
  virtual void taken(int transition, const std::string& event) = 0;
};

/// Selection allocates nothing if no transition is enabled. Not re-entrant: the environment may
/// call raise(), never dispatch() or settle().
class Interpreter {
 public:
  /// `chart` must outlive the interpreter and be valid (checked).
  Interpreter(const Chart& chart, Environment& environment);
  Interpreter(const Interpreter&) = delete;
  Interpreter& operator=(const Interpreter&) = delete;

  /// Enters the initial configuration and runs to completion. taken() is not called for the initial
  /// transition.
  void start();
  /// Processes one external event and runs to completion. Ignored if not running.
  void dispatch(const std::string& event);
  /// Queues an internal event from within execute(), entered() or exited() (<raise>). An event
  /// raised between macrosteps is handled at the beginning of the next one.
  void raise(std::string event);
  /// Takes eventless transitions whose guards have become true, and runs to completion.
  void settle();

  /// State kept between macrosteps.
  struct Memory {
    std::vector<StateId> active;                ///< Document order, the root excluded.
    std::vector<std::vector<StateId>> history;  ///< Indexed by state; empty: nothing recorded.
  };
  [[nodiscard]] Memory memory() const { return {configuration(), history_}; }
  /// Restores a state instead of start(): enters no state and executes no action. The memory must
  /// come from this chart (checked where possible).
  void restore(const Memory& memory);

  /// False before start(), after a final state below the root is entered, and after a livelock. The
  /// configuration then stays, so that the final state can be queried: a final state of the root is
  /// entered but never exited.
  [[nodiscard]] bool running() const { return running_; }
  /// Active states in document order, the root excluded.
  [[nodiscard]] std::vector<StateId> configuration() const;
  [[nodiscard]] bool is_active(StateId state) const {
    return active_[static_cast<std::size_t>(state)];
  }
  /// Event descriptor matching (SCXML 3.12.1): token-wise prefix, "*" matches every event.
  [[nodiscard]] static bool matches(std::string_view descriptor, std::string_view event);

  /// A macrostep with more microsteps than this (raised events that nothing handles included) is a
  /// loop in the chart: the interpreter stops and livelocked() is true.
  static constexpr int kMaxMicrosteps = 1000;
  [[nodiscard]] bool livelocked() const { return livelocked_; }

 private:
  class Stepping;  // Guards against re-entrance.

  [[nodiscard]] const State& state(StateId s) const {
    return chart_.states[static_cast<std::size_t>(s)];
  }
  [[nodiscard]] const Transition& transition(int t) const {
    return chart_.transitions[static_cast<std::size_t>(t)];
  }
  [[nodiscard]] bool is_descendant(StateId s, StateId ancestor) const {
    return s > ancestor && s <= last_descendant_[static_cast<std::size_t>(ancestor)];
  }

  void complete_macrostep();
  void select_eventless_transitions();
  void select_transitions(const std::string& event);
  void select_from_atomic_states(const std::string* event);
  [[nodiscard]] bool is_enabled(const Transition& t, const std::string* event);
  void remove_conflicting_transitions();
  [[nodiscard]] bool exit_sets_intersect(const Transition& t1, const Transition& t2) const;

  void microstep(const std::string& event);
  void fix_domains();
  void exit_states();
  void compute_exit_set();
  void record_history(StateId exited);
  void enter_states();
  void enter(StateId s);
  void complete(StateId final_state);
  [[nodiscard]] bool is_in_final_state(StateId s) const;

  void compute_entry_set(const Transition& t, StateId domain);
  void add_descendant_states_to_enter(StateId s);
  void add_ancestor_states_to_enter(StateId s, StateId ancestor);
  void add_regions_to_enter(StateId parallel);
  [[nodiscard]] bool enters_below(StateId s) const;

  [[nodiscard]] std::span<const StateId> recorded_or_default(StateId history) const;
  template <typename Predicate>
  [[nodiscard]] bool every_effective_target(const Transition& t, Predicate predicate) const;
  [[nodiscard]] StateId transition_domain(const Transition& t) const;
  [[nodiscard]] StateId find_lcca(const Transition& t) const;

  const Chart& chart_;
  Environment& environment_;
  std::vector<StateId> last_descendant_;  // Per state; itself for an atomic state.
  std::vector<bool> active_;
  std::vector<std::vector<StateId>> history_;  // Per state; empty: nothing recorded.
  std::deque<std::string> internal_queue_;
  bool running_ = false;
  bool livelocked_ = false;
  bool stepping_ = false;

  // Working sets of a microstep, allocated once. Sets of states are flags per state: ascending
  // order is entry order, descending order is exit order.
  std::vector<int> enabled_;
  std::vector<int> filtered_;
  std::vector<StateId> domains_;  // Domains of the enabled transitions, in their order.
  std::vector<bool> to_exit_;
  std::vector<bool> to_enter_;
  std::vector<bool> default_entry_;
  std::vector<int> default_history_content_;  // Default transition of a history, per state, or -1.
};

}  // namespace dive::statechart
