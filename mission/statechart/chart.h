#pragma once
// A statechart as data: what SCXML (W3C Recommendation of 1 September 2015) calls the document,
// without XML. Independent of missions and vehicles: guards and actions are numbers that the user
// of the chart defines.

#include <string>
#include <vector>

namespace dive::statechart {

using StateId = int;  ///< Index into Chart::states, which is in document order (depth first).
using GuardId = int;  ///< -1: always true.
using ActionId = int;

enum class StateKind { kAtomic, kCompound, kParallel, kFinal, kShallowHistory, kDeepHistory };

struct Transition {
  StateId source = -1;
  std::vector<std::string>
      events;  ///< Descriptors ("done.state.a", "failsafe.*"); empty: eventless.
  GuardId guard = -1;
  std::vector<StateId> targets;  ///< Empty: targetless.
  bool internal = false;
  std::vector<ActionId> actions;
};

struct State {
  std::string id;
  StateKind kind = StateKind::kAtomic;
  StateId parent = -1;            ///< -1 for the root only.
  std::vector<StateId> children;  ///< Document order, history included.
  std::vector<int> transitions;   ///< Indices into Chart::transitions, document order.
  int initial = -1;               ///< Index of the initial transition (compound, history).
  std::vector<ActionId> on_entry;
  std::vector<ActionId> on_exit;
};

/// states[0] is the root (the <scxml> element): compound, without transitions of its own.
struct Chart {
  std::vector<State> states;
  std::vector<Transition> transitions;

  /// Adds a state below `parent` (-1 for the root) and returns its index. Document order: a state,
  /// then all its descendants, then its next sibling.
  StateId add_state(std::string id, StateKind kind, StateId parent);
  /// Adds an ordinary transition to the end of its source's list and returns its index.
  int add_transition(Transition transition);
  /// Makes `targets` the initial (or, for history, default) transition of `state` and returns its
  /// index. Such a transition may have actions, but neither events nor a guard.
  int set_initial(StateId state, std::vector<StateId> targets);

  /// -1 if there is no state with that id.
  [[nodiscard]] StateId find(const std::string& id) const;
  [[nodiscard]] bool is_descendant(StateId state, StateId ancestor) const;

  /// Empty if the chart can be interpreted, otherwise the first violation as a sentence: document
  /// order, ids unique, every compound state with an initial transition into its own descendants,
  /// targets exist and can be active together, history with a default, final states without
  /// children or transitions, every transition with an event, a guard or a target (3.5.1).
  [[nodiscard]] std::string validate() const;
};

}  // namespace dive::statechart
