#include "mission/states/goal_sequence.h"

#include <utility>

#include "behaviors/goal_sequence.h"
#include "common/assert.h"
#include "mission/document/state_reader.h"

namespace dive::mission {

GoalSequenceState::GoalSequenceState(std::vector<Goal> goals) : goals_(std::move(goals)) {
  DIVE_DEMAND(!goals_.empty());
}

std::vector<const Goal*> GoalSequenceState::goals() const {
  std::vector<const Goal*> goals;
  for (const Goal& goal : goals_) goals.push_back(&goal);
  return goals;
}

std::unique_ptr<behaviors::Behavior> GoalSequenceState::make_behavior(
    const BehaviorSetup& setup) const {
  return std::make_unique<behaviors::GoalSequence>(setup.leg, leg_goals(setup.scene, goals_),
                                                   first_goal(setup, goals_.size()));
}

void read_goal_sequence(const XmlElement& element, const StateReader& reader, StateSpec& spec) {
  spec.atomic = std::make_shared<GoalSequenceState>(reader.goals_in(element));
}

}  // namespace dive::mission
