#pragma once
// Failsafes: conditions that are watched whatever the mission does, and one ordered ladder of what
// to do about them. A higher rung always wins. warn, replan and hold are taken back when their
// cause has been gone for a while; retrace and all above it are never left downwards, and
// emergency_surface never at all.

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "common/clock.h"

namespace dive::behaviors {

enum class Rung { kNone, kWarn, kReplan, kHold, kRetrace, kAbortAndSurface, kEmergencySurface };

[[nodiscard]] const char* to_string(Rung rung);
/// Of those a mission may name: warn and up.
[[nodiscard]] std::optional<Rung> find_rung(std::string_view name);

enum class FailsafeKind {
  kLeak,
  kBattery,            ///< Charge below a fraction.
  kTemperature,        ///< Of the hull's inside, above a limit.
  kOverdepth,          ///< Deeper than the mission allows.
  kUnderAltitude,      ///< Nearer to the ground below than the mission allows.
  kGeofence,           ///< Outside of the fence.
  kOvertime,           ///< The mission takes longer than it may.
  kOverdueLeg,         ///< One leg takes a multiple of the time it should.
  kStuck,              ///< Under way, yet in the same place.
  kImuLost,            ///< No plausible sample for a while.
  kDepthLost,          ///< The same, or a sensor that never changes.
  kHealthLost,         ///< The same.
  kRangeLost,          ///< In unknown water: nothing new is seen for a while.
  kEstimatorDiverged,  ///< The estimate is not finite, or denies the depth sensor.
  kLocalisationLost,   ///< The position is too uncertain.
  kPlannerFailure,     ///< Plans fail in a row, or none are left.
  kCommsLost,          ///< No heartbeat from topside.
  kOperatorAbort,      ///< Topside says so.
  kRetraceFailure,     ///< The way out could not be swum.
  kInternalError,      ///< One of our own assertions failed.
};
inline constexpr std::size_t kFailsafeCount = 20;

struct FailsafePolicy {
  Rung rung = Rung::kAbortAndSurface;  ///< kNone: not watched.
  double persistence_s = 0.0;          ///< The condition must hold without a break that long.
  double clear_s = 5.0;                ///< ... and be gone that long before the rung is taken back.
  double escalate_s = 60.0;  ///< replan, and hold in open water, become abort_and_surface then;
                             ///< hold for want of range anywhere, for the way back was swum.
};

/// What a failsafe is when a mission says nothing about it.
struct FailsafeTraits {
  FailsafeKind kind;
  std::string_view name;  ///< In missions, events (failsafe.NAME) and logs.
  FailsafePolicy policy;
  std::string_view threshold_name;  ///< The attribute that sets it; empty: it has none.
  double threshold = 0.0;
  bool in_missions = true;  ///< May a mission name it?
};
[[nodiscard]] const FailsafeTraits& traits(FailsafeKind kind);
[[nodiscard]] std::optional<FailsafeKind> find_failsafe(std::string_view name);
[[nodiscard]] inline std::string_view to_string(FailsafeKind kind) { return traits(kind).name; }

/// Indexed by FailsafeKind.
using FailsafePolicies = std::array<FailsafePolicy, kFailsafeCount>;
using FailsafeConditions = std::array<bool, kFailsafeCount>;  ///< What is true this tick.

[[nodiscard]] FailsafePolicies default_policies();

class FailsafeLadder {
 public:
  explicit FailsafeLadder(const FailsafePolicies& policies);

  struct Change {
    Rung rung = Rung::kNone;
    FailsafeKind cause = FailsafeKind::kLeak;  ///< The one that set the rung.
    std::vector<FailsafeKind> competing;       ///< Others that are active.
    bool escalated = false;                    ///< The cause's own rung has lasted too long.
  };
  /// One tick; a change of rung or of its cause, if there was one. `open_above`: hold escalates
  /// only where the vehicle can ascend, except kRangeLost. Allocates only when there is a change.
  [[nodiscard]] std::optional<Change> update(Utime now, const FailsafeConditions& conditions,
                                             bool open_above);

  /// Goes on from a rung that another ladder had reached.
  void restore(Rung rung, FailsafeKind cause) {
    rung_ = rung;
    cause_ = cause;
  }

  [[nodiscard]] Rung rung() const { return rung_; }
  /// The failsafe that set the present rung; meaningful above kNone.
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
  [[nodiscard]] static bool is_overdue(const Watch& watch, Utime now, bool has_way_out);

  std::array<Watch, kFailsafeCount> watches_;
  Rung rung_ = Rung::kNone;
  FailsafeKind cause_ = FailsafeKind::kLeak;
};

}  // namespace dive::behaviors
