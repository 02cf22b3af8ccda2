#pragma once
// Triggers that replan the path being followed.

#include <optional>

#include "common/clock.h"

namespace dive::behaviors {

struct ReplanPolicy {
  std::optional<double> period_s;       ///< Time between replans, s.
  std::optional<double> deviation_m;    ///< Distance from the path, m.
  std::optional<double> clearance_m;    ///< Clearance of the rest of the path, m.
  std::optional<double> no_progress_s;  ///< Time without progress towards the goal, s.
  /// Replan when an obstacle blocks the path, or one is gone and a shorter path may exist.
  bool map_change = true;
  bool estimator_switch = true;  ///< Replan when the active estimator changes.
  double deviation_persistence_s = 0.5;
  double min_interval_s = 2.0;  ///< Least time between two replans, whatever the trigger, s.
  int max_replans = 50;         ///< Budget of a leg: a vehicle must not replan for ever.
};

enum class ReplanCause {
  kNone,
  kPeriod,
  kDeviation,
  kClearance,
  kNoProgress,
  kMapChanged,
  kEstimatorSwitched,
  kPositionCorrected,
  kDemanded,  ///< Requested by a failsafe.
};

[[nodiscard]] const char* to_string(ReplanCause cause);

/// Inputs of the triggers, every tick.
struct ReplanSignals {
  double deviation_m = 0.0;
  double distance_to_go_m = 0.0;
  /// Clearance of the rest of the path in the map as it is now; only if the map has changed.
  std::optional<double> new_clearance_m;
  bool path_blocked = false;  ///< True if that clearance is less than the leg allows.
  bool may_be_shorter =
      false;  ///< An obstacle is gone, and the rest of the path is no straight line.
  bool estimator_switched = false;
  bool position_corrected = false;  ///< The estimated position has jumped.
  bool demanded = false;
};

class ReplanTriggers {
 public:
  explicit ReplanTriggers(ReplanPolicy policy) : policy_(policy) {}

  /// A new path is being followed from `now` on.
  void path_started(Utime now);
  /// Advances one tick. Every result but kNone requests a replan and is taken from the budget. An
  /// event within min_interval_s of a replan is kept until the interval is over.
  [[nodiscard]] ReplanCause update(Utime now, const ReplanSignals& signals);
  /// Takes a replan from the budget for the caller; false if the budget is used up.
  [[nodiscard]] bool take_one();
  [[nodiscard]] int replans() const { return replans_; }

 private:
  [[nodiscard]] ReplanCause pending(Utime now, const ReplanSignals& signals);

  ReplanPolicy policy_;
  Utime path_start_ = 0;
  std::optional<Utime> deviating_since_;
  std::optional<double> nearest_m_;  ///< Least distance to the goal so far, m.
  Utime nearest_at_ = 0;             ///< Time of that distance, us.
  ReplanCause kept_ = ReplanCause::kNone;
  int replans_ = 0;
};

}  // namespace dive::behaviors
