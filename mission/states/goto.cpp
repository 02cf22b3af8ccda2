#include "mission/states/goto.h"

#include <utility>

#include "behaviors/goal_sequence.h"
#include "mission/document/state_reader.h"

namespace dive::mission {

GotoState::GotoState(Goal goal) : goal_(std::move(goal)) {}

std::unique_ptr<behaviors::Behavior> GotoState::make_behavior(const BehaviorSetup& setup) const {
  return std::make_unique<behaviors::GoalSequence>(
      setup.leg, std::vector<behaviors::LegGoal>{leg_goal(setup.scene, goal_)});
}

void read_goto(const XmlElement& element, const StateReader& reader, StateSpec& spec) {
  spec.atomic = std::make_shared<GotoState>(reader.goal(element));
}

}  // namespace dive::mission
