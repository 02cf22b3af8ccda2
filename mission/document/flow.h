#pragma once
// Where the machine of a mission can go, as a graph. Guards count as possible, and parallel regions
// as independent: what is said to be impossible is; what is said to be possible may not be.

#include <string_view>
#include <vector>

#include "mission/document/mission.h"
#include "mission/document/state_index.h"

namespace dive::mission {

class Flow {
 public:
  /// What sets off a transition.
  struct Trigger {
    enum class Kind {
      kDone,
      kPlanFailed,
      kTimeout,
      kEmergency,  ///< A failsafe, or the operator.
      kAlways      ///< No event, or any.
    } kind = Kind::kAlways;
    int state = -1;  ///< The one that it is about; -1: any.
  };

  /// A transition, or the way that on_timeout leads.
  struct Arc {
    int owner = -1;                        ///< State it stands in.
    const TransitionSpec* spec = nullptr;  ///< Null for on_timeout.
    std::vector<Trigger> triggers;
    std::vector<int> lands;       ///< Leaves and finals entered, by default histories.
    std::vector<int> returns;     ///< What a history may bring back besides.
    std::vector<int> histories;   ///< Passed on the way.
    bool only_emergency = false;  ///< Only failsafes and the operator raise its events.
  };

  /// Every name in the mission is right.
  Flow(const Mission& mission, const StateIndex& index);

  /// States, histories included, that may be entered.
  [[nodiscard]] bool entered(int state) const { return entered_[cast(state)]; }
  [[nodiscard]] const std::vector<Arc>& arcs() const { return arcs_; }
  /// Arcs that may be followed while the leaf or final `state` is active.
  [[nodiscard]] const std::vector<int>& arcs_from(int state) const {
    return arcs_from_[cast(state)];
  }
  /// Leaves and finals entered first.
  [[nodiscard]] const std::vector<int>& first() const { return first_.lands; }

  /// Those of the leaves and finals from which one in `goals` can be reached in the course of the
  /// mission: without failsafes and the operator.
  [[nodiscard]] std::vector<bool> can_reach(const std::vector<bool>& goals) const;
  /// Those that can be reached so from the beginning without entering one that `avoid` names.
  [[nodiscard]] std::vector<bool> reached_without(const std::vector<bool>& avoid) const;
  /// Those that end the mission.
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
  std::vector<std::vector<int>> arcs_of_;    ///< By owner.
  std::vector<std::vector<int>> arcs_from_;  ///< By leaf or final.
  std::vector<bool> entered_;
  /// May a done.state.ID be handled only after the state was left? An eventless transition comes
  /// before it, and regions of a parallel may raise several at once.
  bool done_may_be_late_ = false;
};

}  // namespace dive::mission
