#pragma once
// Failsafes: conditions that are watched whatever the mission does, and one ordered ladder of what
// to do about them. A higher rung always wins; abort_and_surface is never left downwards, and
// emergency_surface never at all.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"

namespace dive::behaviors {

enum class Rung { kNone, kWarn, kReplan, kHold, kRetrace, kAbortAndSurface, kEmergencySurface };

[[nodiscard]] const char* to_string(Rung rung);

enum class FailsafeKind {
  kLeak,
  kOvertime,
  kOverdepth,
  kPlannerFailure,
  kRetraceFailure,  ///< The way out could not be swum.
  kInternalError,   ///< One of our own assertions failed.
};
inline constexpr std::size_t kFailsafeCount = 6;

[[nodiscard]] const char* to_string(FailsafeKind kind);

struct FailsafePolicy {
  Rung rung = Rung::kAbortAndSurface;
  double persistence_s = 0.0;  ///< The condition must hold without a break that long.
  double clear_s = 5.0;        ///< ... and be gone that long before a warning is taken back.
};

/// What is true this tick; index by FailsafeKind.
using FailsafeConditions = std::array<bool, kFailsafeCount>;

class FailsafeLadder {
 public:
  explicit FailsafeLadder(const std::array<FailsafePolicy, kFailsafeCount>& policies);

  struct Change {
    Rung rung = Rung::kNone;
    FailsafeKind cause = FailsafeKind::kLeak;  ///< The one that set the rung.
    std::vector<FailsafeKind> competing;       ///< Others that are active.
  };
  /// One tick; a change of rung, if there was one.
  [[nodiscard]] std::optional<Change> update(Utime now, const FailsafeConditions& conditions);

  [[nodiscard]] Rung rung() const { return rung_; }
  /// The failsafe that set the present rung; meaningful above kNone.
  [[nodiscard]] FailsafeKind cause() const { return cause_; }

 private:
  struct Watch {
    FailsafePolicy policy;
    std::optional<Utime> true_since;
    std::optional<Utime> false_since;
    bool active = false;
  };
  static void advance(Watch& watch, Utime now, bool condition);

  std::array<Watch, kFailsafeCount> watches_;
  Rung rung_ = Rung::kNone;
  FailsafeKind cause_ = FailsafeKind::kLeak;
};

}  // namespace dive::behaviors
