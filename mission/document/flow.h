#pragma once
// The paths through a mission's machine, as a graph. Every guard is assumed possible and parallel
// regions independent: what the graph excludes is impossible; what it contains may still be
// impossible.

#include <string_view>
#include <vector>

#include "mission/document/mission.h"
#include "mission/document/state_index.h"

namespace dive::mission {

class Flow {
 public:
  /// The cause of a transition.
  struct Trigger {
    enum class Kind {
      kDone,
      kPlanFailed,
      kTimeout,
      kEmergency,  ///< A failsafe or the operator.
      kAlways      ///< No event, or any event.
    } kind = Kind::kAlways;
    int state = -1;  ///< State of the event; -1: any.
  };

  /// A transition, or the on_timeout of a state.
  struct Arc {
    int owner = -1;                        ///< State that contains it.
    const TransitionSpec* spec = nullptr;  ///< Null for on_timeout.
    std::vector<Trigger> triggers;
    std::vector<int> lands;       ///< Atomic and final states entered, by default histories.
    std::vector<int> returns;     ///< Other states that a history may restore.
    std::vector<int> histories;   ///< History states passed through.
    bool only_emergency = false;  ///< True if only failsafes and the operator raise its events.
  };

  /// Requires that every name in the mission resolves.
  Flow(const Mission& mission, const StateIndex& index);

  /// True for states, histories included, that may be entered.
  [[nodiscard]] bool entered(int state) const { return entered_[cast(state)]; }
  [[nodiscard]] const std::vector<Arc>& arcs() const { return arcs_; }
  /// Arcs that may be followed while the atomic or final `state` is active.
  [[nodiscard]] const std::vector<int>& arcs_from(int state) const {
    return arcs_from_[cast(state)];
  }
  /// Atomic and final states entered first.
  [[nodiscard]] const std::vector<int>& first() const { return first_.lands; }

  /// The atomic and final states from which one in `goals` can be reached in the nominal course of
  /// the mission, that is without failsafes and the operator.
  [[nodiscard]] std::vector<bool> can_reach(const std::vector<bool>& goals) const;
  /// The states that can be reached from the initial state in the nominal course without entering
  /// one in `avoid`.
  [[nodiscard]] std::vector<bool> reached_without(const std::vector<bool>& avoid) const;
  /// The states that end the mission.
  [[nodiscard]] std::vector<bool> ends() const;

 private:
  static std::size_t cast(int i) { return static_cast<std::size_t>(i); }

  void add_arcs(int state);
  [[nodiscard]] Trigger trigger(std::string_view descriptor) const;
  void land(int target, Arc& arc) const;
  void land_inside(int state, Arc& arc) const;
  void land_in_history(int state, Arc& arc) const;
  void enter_from_the_beginning();
  void enter(const Arc& arc, std::vector<int>& pending);
  void bring_back(std::vector<int>& pending);
  void find_arcs_from(int state);
  [[nodiscard]] bool may_happen(const Trigger& trigger, int state, int parallel) const;

  const StateIndex& index_;
  Arc first_;
  std::vector<Arc> arcs_;
  std::vector<std::vector<int>> arcs_of_;    ///< Indexed by owner.
  std::vector<std::vector<int>> arcs_from_;  ///< Indexed by atomic or final state.
  std::vector<bool> entered_;
  /// True if a done.state.ID may be handled only after its state was left. An eventless transition
  /// precedes it, and regions of a parallel may raise several at once.
  bool done_may_be_late_ = false;
};

}  // namespace dive::mission
