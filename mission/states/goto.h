#pragma once
// <goto>: one goal, which has the id of the state.

#include "mission/states/atomic_state.h"

namespace dive {
struct XmlElement;
}

namespace dive::mission {

class StateReader;

class GotoState final : public AtomicState {
 public:
  explicit GotoState(Goal goal);

  [[nodiscard]] std::vector<const Goal*> goals() const override { return {&goal_}; }
  [[nodiscard]] bool is_its_goal() const override { return true; }
  [[nodiscard]] std::unique_ptr<behaviors::Behavior> make_behavior(
      const BehaviorSetup& setup) const override;

 private:
  Goal goal_;
};

void read_goto(const XmlElement& element, const StateReader& reader, StateSpec& spec);

}  // namespace dive::mission
