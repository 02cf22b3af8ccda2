#include "behaviors/failsafes.h"

namespace dive::behaviors {

const char* to_string(Rung rung) {
  switch (rung) {
    case Rung::kNone:
      return "none";
    case Rung::kWarn:
      return "warn";
    case Rung::kReplan:
      return "replan";
    case Rung::kHold:
      return "hold";
    case Rung::kRetrace:
      return "retrace";
    case Rung::kAbortAndSurface:
      return "abort_and_surface";
    case Rung::kEmergencySurface:
      return "emergency_surface";
  }
  return "none";
}

const char* to_string(FailsafeKind kind) {
  switch (kind) {
    case FailsafeKind::kLeak:
      return "leak";
    case FailsafeKind::kOvertime:
      return "overtime";
    case FailsafeKind::kOverdepth:
      return "overdepth";
    case FailsafeKind::kPlannerFailure:
      return "planner_failure";
    case FailsafeKind::kRetraceFailure:
      return "retrace_failure";
    case FailsafeKind::kInternalError:
      return "internal_error";
  }
  return "internal_error";
}

FailsafeLadder::FailsafeLadder(const std::array<FailsafePolicy, kFailsafeCount>& policies) {
  for (std::size_t i = 0; i < kFailsafeCount; ++i) watches_[i].policy = policies[i];
}

void FailsafeLadder::advance(Watch& watch, Utime now, bool condition) {
  if (condition) {
    watch.false_since.reset();
    if (!watch.true_since) watch.true_since = now;
    if (to_seconds(now - *watch.true_since) >= watch.policy.persistence_s) watch.active = true;
    return;
  }
  watch.true_since.reset();
  if (!watch.false_since) watch.false_since = now;
  if (to_seconds(now - *watch.false_since) >= watch.policy.clear_s) watch.active = false;
}

std::optional<FailsafeLadder::Change> FailsafeLadder::update(Utime now,
                                                             const FailsafeConditions& conditions) {
  Rung highest = Rung::kNone;
  FailsafeKind cause = cause_;
  for (std::size_t i = 0; i < kFailsafeCount; ++i) {
    advance(watches_[i], now, conditions[i]);
    if (watches_[i].active && watches_[i].policy.rung > highest) {
      highest = watches_[i].policy.rung;
      cause = static_cast<FailsafeKind>(i);
    }
  }
  const bool latched = rung_ >= Rung::kAbortAndSurface;
  if (highest == rung_ || (latched && highest < rung_)) return std::nullopt;

  rung_ = highest;
  cause_ = cause;
  Change change{rung_, cause_, {}};
  for (std::size_t i = 0; i < kFailsafeCount; ++i) {
    const auto kind = static_cast<FailsafeKind>(i);
    if (watches_[i].active && kind != cause_) change.competing.push_back(kind);
  }
  return change;
}

}  // namespace dive::behaviors
