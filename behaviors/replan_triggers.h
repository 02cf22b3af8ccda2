#pragma once
// When a path being followed is replanned.

#include <optional>

#include "common/clock.h"

namespace dive::behaviors {

struct ReplanPolicy {
  std::optional<double> period_s;     ///< Every so often.
  std::optional<double> deviation_m;  ///< When further from the path than this.
  std::optional<double>
      clearance_m;  ///< When the map shows something nearer to the path than this.
  std::optional<double> no_progress_s;  ///< When so long no nearer to the goal.
  bool map_change = true;               ///< When the map shows something in the path.
  bool estimator_switch = true;         ///< When another estimator has taken over.
  double deviation_persistence_s = 0.5;
  double min_interval_s = 2.0;  ///< Between two replans, whatever the trigger.
  int max_replans = 50;         ///< Per leg: a vehicle must not replan for ever.
};

enum class ReplanCause {
  kNone,
  kPeriod,
  kDeviation,
  kClearance,
  kNoProgress,
  kMapChanged,
  kEstimatorSwitched,
  kDemanded,  ///< By a failsafe.
};

[[nodiscard]] const char* to_string(ReplanCause cause);

/// What the triggers look at, every tick.
struct ReplanSignals {
  double deviation_m = 0.0;
  double distance_to_go_m = 0.0;
  /// Of the rest of the path to what the map shows now; only when that has changed.
  std::optional<double> new_clearance_m;
  bool path_blocked = false;  ///< ... and that is less than the leg may have.
  bool estimator_switched = false;
  bool demanded = false;
};

class ReplanTriggers {
 public:
  explicit ReplanTriggers(ReplanPolicy policy) : policy_(policy) {}

  /// A new path is being followed from `now` on.
  void path_started(Utime now);
  /// One tick. Anything but kNone asks for a replan and counts against the budget. What happens
  /// between two replans that are too close together is kept until the next may be.
  [[nodiscard]] ReplanCause update(Utime now, const ReplanSignals& signals);
  /// Takes one from the budget for a cause of the caller's own; false when it is used up.
  [[nodiscard]] bool take_one();
  [[nodiscard]] int replans() const { return replans_; }

 private:
  [[nodiscard]] ReplanCause pending(Utime now, const ReplanSignals& signals);

  ReplanPolicy policy_;
  Utime path_start_ = 0;
  std::optional<Utime> deviating_since_;
  std::optional<double> nearest_m_;  ///< To the goal, so far ...
  Utime nearest_at_ = 0;             ///< ... and when.
  ReplanCause kept_ = ReplanCause::kNone;
  int replans_ = 0;
};

}  // namespace dive::behaviors
