#pragma once
// A behaviour's conversation with the planner: one question at a time, and an answer, or none in
// time. What a behaviour asks is its own affair; when it has failed is decided here, for all.

#include <string>

#include "behaviors/behavior.h"

namespace dive::behaviors {

class PlanClient {
 public:
  enum class Event {
    kNone,
    kPath,    ///< BehaviorInput::plan is the answer, with a path that may be followed.
    kFailed,  ///< The answer has no path, or there was none within kPlanTimeout: see reason().
  };

  /// The request goes out this tick. An earlier one that is still open is dropped.
  void ask(Utime now);
  /// What comes now was planned for another situation: it is ignored.
  void cancel() { is_pending_ = false; }
  /// Once a tick, before anything else. Answers to what was not asked are ignored.
  [[nodiscard]] Event update(const BehaviorInput& input);

  [[nodiscard]] bool is_pending() const { return is_pending_; }
  /// Why the last question failed; empty when it did not.
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  [[nodiscard]] Event fail(std::string reason);

  bool is_pending_ = false;
  Utime asked_at_ = 0;
  std::string reason_;
};

}  // namespace dive::behaviors
