#pragma once
// goto and goal_sequence: legs in the order written.

#include <optional>
#include <vector>

#include "behaviors/behavior.h"
#include "behaviors/leg.h"

namespace dive::behaviors {

class GoalSequence final : public Behavior {
 public:
  /// Demands at least one goal; starts with the goal at index `first`.
  GoalSequence(const LegSettings& settings, std::vector<LegGoal> goals, std::size_t first = 0);

  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return leg_->progress(); }
  [[nodiscard]] bool needs_free_ahead() const override { return !leg_->is_backing_off(); }
  void way_ahead(const Pose& X_WB, double seconds, std::vector<Pose>& way) const override {
    leg_->way_ahead(X_WB, seconds, way);
  }
  [[nodiscard]] bool request_alternative() override { return leg_->request_alternative(); }
  /// Continues with the next goal; false at the last one.
  [[nodiscard]] bool skip() override;
  [[nodiscard]] int goals_done() const override { return static_cast<int>(current_); }

 private:
  void begin_next();

  LegSettings settings_;
  std::vector<LegGoal> goals_;
  std::size_t current_ = 0;
  std::optional<Leg> leg_;
};

}  // namespace dive::behaviors
