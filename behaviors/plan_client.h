#pragma once
// A behaviour's exchange with the planner: one request at a time, its answer, and its timeout. What
// counts as a failure is decided here for all behaviours.

#include <string>

#include "behaviors/behavior.h"

namespace dive::behaviors {

class PlanClient {
 public:
  enum class Event {
    kNone,
    kPath,    ///< BehaviorInput::plan is the answer and has a path that may be followed.
    kFailed,  ///< The answer has no path, or none came within kPlanTimeout: see reason().
  };

  /// Records a request sent in this tick. An earlier open request is dropped.
  void ask(Utime now);
  /// Drops the open request; its answer is ignored.
  void cancel() { is_pending_ = false; }
  /// Called once per tick before anything else. Answers without a request are ignored.
  [[nodiscard]] Event update(const BehaviorInput& input);

  [[nodiscard]] bool is_pending() const { return is_pending_; }
  /// Reason of the failure of the last request; empty if it did not fail.
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  [[nodiscard]] Event fail(std::string reason);

  bool is_pending_ = false;
  Utime asked_at_ = 0;
  std::string reason_;
};

}  // namespace dive::behaviors
