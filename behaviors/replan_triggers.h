#pragma once
// When a path being followed is planned anew.

#include <optional>

#include "common/clock.h"

namespace dive::behaviors {

struct ReplanPolicy {
  std::optional<double> period_s;     ///< Every so often.
  std::optional<double> deviation_m;  ///< When further from the path than this.
  double deviation_persistence_s = 0.5;
  double min_interval_s = 2.0;  ///< Between two replans, whatever the trigger.
  int max_replans = 50;         ///< Per leg: a vehicle must not replan for ever.
};

enum class ReplanCause { kNone, kPeriod, kDeviation };

[[nodiscard]] const char* to_string(ReplanCause cause);

class ReplanTriggers {
 public:
  explicit ReplanTriggers(ReplanPolicy policy) : policy_(policy) {}

  /// A new path is being followed from `now` on.
  void path_started(Utime now);
  /// One tick. Anything but kNone asks for a replan and counts against the budget.
  [[nodiscard]] ReplanCause update(Utime now, double deviation_m);
  /// Takes one from the budget for a cause of the caller's own; false when it is used up.
  [[nodiscard]] bool take_one();
  [[nodiscard]] int replans() const { return replans_; }

 private:
  ReplanPolicy policy_;
  Utime path_start_ = 0;
  std::optional<Utime> deviating_since_;
  int replans_ = 0;
};

}  // namespace dive::behaviors
