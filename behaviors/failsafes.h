#pragma once
// Failsafes: conditions that are watched whatever the mission does, and one ordered ladder of what
// to do about them. A higher rung always wins. warn, replan and hold are withdrawn when their cause
// has been absent for a while; from retrace upwards the ladder never goes down, and
// emergency_surface is final.

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "common/clock.h"

namespace dive::behaviors {

enum class Rung { kNone, kWarn, kReplan, kHold, kRetrace, kAbortAndSurface, kEmergencySurface };

[[nodiscard]] const char* to_string(Rung rung);
/// A rung that a mission may name: warn and higher; empty for any other name.
[[nodiscard]] std::optional<Rung> find_rung(std::string_view name);

enum class FailsafeKind {
  kLeak,
  kBattery,            ///< Charge below a fraction.
  kTemperature,        ///< Temperature inside the hull above a limit.
  kOverdepth,          ///< Deeper than the mission allows.
  kMinAltitude,        ///< Lower above the ground than the mission allows.
  kGeofence,           ///< Outside the fence.
  kMissionTimeout,     ///< The mission has exceeded its time limit.
  kLegTimeout,         ///< A leg has taken a multiple of its expected time.
  kStuck,              ///< Commanded to move, but in the same place.
  kImuLost,            ///< No plausible sample for a while.
  kDepthLost,          ///< The same, or a reading that never changes.
  kHealthLost,         ///< The same.
  kRangeLost,          ///< No new range data for a while, where the dive depends on them.
  kEstimatorDiverged,  ///< The estimate is not finite, or contradicts the depth sensor.
  kLocalisationLost,   ///< The position is too uncertain for the clearance ahead.
  kWrongMap,           ///< The scans show another place than the map.
  kPlannerFailure,     ///< Several plans failed in a row, or the replan budget is used up.
  kCommsLost,          ///< No heartbeat from topside.
  kOperatorAbort,      ///< Topside requested an abort.
  kLogLost,            ///< Log or journal are being lost, because the disk is slow or full.
  kRetraceFailure,     ///< The exit path could not be swum.
  kInternalError,      ///< One of our own assertions failed.
};
inline constexpr std::size_t kFailsafeCount = 22;

struct FailsafePolicy {
  Rung rung = Rung::kAbortAndSurface;  ///< kNone: not monitored.
  double persistence_s = 0.0;          ///< Uninterrupted time before the failsafe is active, s.
  double clear_s = 5.0;                ///< Time without the condition before the rung ends, s.
  /// Time after which replan, and hold in open water, become abort_and_surface, s. A hold caused by
  /// kRangeLost becomes one under an overhead too, because the trail back was swum.
  double escalate_s = 60.0;
};

/// Name and default policy of a failsafe.
struct FailsafeTraits {
  FailsafeKind kind;
  std::string_view name;  ///< Name in missions, events (failsafe.NAME) and logs.
  FailsafePolicy policy;
  std::string_view threshold_name;  ///< Attribute of the threshold; empty: no threshold.
  double threshold = 0.0;
  bool in_missions = true;  ///< True if a mission may name it.
};
[[nodiscard]] const FailsafeTraits& traits(FailsafeKind kind);
[[nodiscard]] std::optional<FailsafeKind> find_failsafe(std::string_view name);
[[nodiscard]] inline std::string_view to_string(FailsafeKind kind) { return traits(kind).name; }

/// Indexed by FailsafeKind.
using FailsafePolicies = std::array<FailsafePolicy, kFailsafeCount>;
using FailsafeConditions = std::array<bool, kFailsafeCount>;  ///< Conditions of one tick.

[[nodiscard]] FailsafePolicies default_policies();

class FailsafeLadder {
 public:
  explicit FailsafeLadder(const FailsafePolicies& policies);

  struct Change {
    Rung rung = Rung::kNone;
    FailsafeKind cause = FailsafeKind::kLeak;  ///< Failsafe that set the rung.
    std::vector<FailsafeKind> competing;       ///< Other active failsafes.
    bool escalated = false;                    ///< The rung of the cause lasted too long.
  };
  /// Advances one tick; returns a change of the rung or of its cause. `open_above`: hold escalates
  /// only where the vehicle can ascend, except kRangeLost. Allocates only when there is a change.
  [[nodiscard]] std::optional<Change> update(Utime now, const FailsafeConditions& conditions,
                                             bool open_above);

  /// Continues from the rung of another ladder, after a restart.
  void restore(Rung rung, FailsafeKind cause) {
    rung_ = rung;
    cause_ = cause;
  }

  [[nodiscard]] Rung rung() const { return rung_; }
  /// Failsafe that set the present rung; undefined for kNone.
  [[nodiscard]] FailsafeKind cause() const { return cause_; }
  [[nodiscard]] bool is_active(FailsafeKind kind) const {
    return watches_[static_cast<std::size_t>(kind)].active_since.has_value();
  }

 private:
  struct Watch {
    FailsafePolicy policy;
    std::optional<Utime> true_since;
    std::optional<Utime> false_since;
    std::optional<Utime> active_since;
  };
  static void advance(Watch& watch, Utime now, bool condition);
  [[nodiscard]] static bool is_overdue(const Watch& watch, Utime now, bool may_leave_hold);

  std::array<Watch, kFailsafeCount> watches_;
  Rung rung_ = Rung::kNone;
  FailsafeKind cause_ = FailsafeKind::kLeak;
};

}  // namespace dive::behaviors
