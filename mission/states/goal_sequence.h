#pragma once
// <goal_sequence>: goals in the order written. Other elements that come down to goals are read as
// this state, too.

#include "mission/states/atomic_state.h"

namespace dive {
struct XmlElement;
}

namespace dive::mission {

class StateReader;

class GoalSequenceState final : public AtomicState {
 public:
  /// At least one goal.
  explicit GoalSequenceState(std::vector<Goal> goals);

  [[nodiscard]] std::vector<const Goal*> goals() const override;
  [[nodiscard]] std::unique_ptr<behaviors::Behavior> make_behavior(
      const BehaviorSetup& setup) const override;

 private:
  std::vector<Goal> goals_;
};

void read_goal_sequence(const XmlElement& element, const StateReader& reader, StateSpec& spec);

}  // namespace dive::mission
