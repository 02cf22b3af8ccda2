#include "behaviors/goal_sequence.h"

#include <utility>

#include "common/assert.h"

namespace dive::behaviors {

GoalSequence::GoalSequence(const LegSettings& settings, std::vector<LegGoal> goals,
                           std::size_t first)
    : settings_(settings), goals_(std::move(goals)), current_(first) {
  DIVE_DEMAND(first < goals_.size());
  settings_.seed += 1000 * first;
  leg_.emplace(settings_, goals_[first]);
}

void GoalSequence::begin_next() {
  ++current_;
  settings_.seed += 1000;  // each leg draws from its own seed
  leg_.emplace(settings_, goals_[current_]);
}

bool GoalSequence::skip() {
  if (current_ + 1 == goals_.size()) return false;
  begin_next();
  return true;
}

BehaviorOutput GoalSequence::step(const BehaviorInput& input) {
  BehaviorOutput output = leg_->step(input);
  if (output.done && current_ + 1 < goals_.size()) {
    begin_next();
    BehaviorInput next = input;
    next.plan = nullptr;  // it answers a request of the previous leg
    output = leg_->step(next);
  }
  return output;
}

}  // namespace dive::behaviors
