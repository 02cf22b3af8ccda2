#include "behaviors/failsafes.h"

#include <algorithm>

namespace dive::behaviors {
namespace {

constexpr std::array<std::string_view, 7> kRungNames = {
    "none", "warn", "replan", "hold", "retrace", "abort_and_surface", "emergency_surface"};

constexpr FailsafePolicy policy(Rung rung, double persistence_s, double clear_s = 5.0,
                                double escalate_s = 60.0) {
  return {
      .rung = rung, .persistence_s = persistence_s, .clear_s = clear_s, .escalate_s = escalate_s};
}

using Kind = FailsafeKind;

// In the order of FailsafeKind. Where the mission sets the limit elsewhere (depth, altitude, time)
// there is no threshold of its own.
constexpr std::array<FailsafeTraits, kFailsafeCount> kTraits = {{
    {Kind::kLeak, "leak", policy(Rung::kAbortAndSurface, 1.0), {}},
    {Kind::kBattery, "battery", policy(Rung::kAbortAndSurface, 5.0), "below"},
    {Kind::kTemperature, "temperature", policy(Rung::kAbortAndSurface, 10.0), "above", 60.0},
    {Kind::kOverdepth, "overdepth", policy(Rung::kAbortAndSurface, 2.0), {}},
    {Kind::kMinAltitude, "min_altitude", policy(Rung::kWarn, 3.0), {}},
    {Kind::kGeofence, "geofence", policy(Rung::kNone, 2.0), {}},
    {Kind::kMissionTimeout, "mission_timeout", policy(Rung::kAbortAndSurface, 0.0), {}},
    {Kind::kLegTimeout, "leg_timeout", policy(Rung::kWarn, 0.0), "factor", 3.0},
    {Kind::kStuck, "stuck", policy(Rung::kReplan, 0.0, 10.0), "time", 30.0},
    {Kind::kImuLost, "imu_lost", policy(Rung::kHold, 0.0, 2.0, 2.0), "after", 0.5},
    {Kind::kDepthLost, "depth_lost", policy(Rung::kAbortAndSurface, 0.0), "after", 2.0},
    {Kind::kHealthLost, "health_lost", policy(Rung::kAbortAndSurface, 0.0), "after", 30.0},
    {Kind::kRangeLost, "range_lost", policy(Rung::kHold, 0.0, 2.0, 20.0), "after", 2.0},
    {Kind::kEstimatorDiverged, "estimator_diverged", policy(Rung::kAbortAndSurface, 2.0),
     "difference", 1.0},
    {Kind::kLocalisationLost, "localisation_lost", policy(Rung::kWarn, 2.0), "margin", 1.5},
    {Kind::kWrongMap, "wrong_map", policy(Rung::kAbortAndSurface, 0.0), {}},
    {Kind::kPlannerFailure, "planner_failure", policy(Rung::kAbortAndSurface, 0.0), "failures",
     3.0},
    {Kind::kCommsLost, "comms_lost", policy(Rung::kNone, 0.0), "after", 60.0},
    {Kind::kOperatorAbort, "operator_abort", policy(Rung::kAbortAndSurface, 0.0), {}},
    {Kind::kLogLost, "log_lost", policy(Rung::kWarn, 0.0), {}},
    {Kind::kRetraceFailure,
     "retrace_failure",
     policy(Rung::kEmergencySurface, 0.0),
     {},
     0.0,
     false},
    {Kind::kInternalError, "internal_error", policy(Rung::kEmergencySurface, 0.0), {}, 0.0, false},
}};

constexpr bool in_order() {
  for (std::size_t i = 0; i < kTraits.size(); ++i) {
    if (kTraits[i].kind != static_cast<FailsafeKind>(i)) return false;
  }
  return true;
}
static_assert(in_order());

}  // namespace

const char* to_string(Rung rung) { return kRungNames[static_cast<std::size_t>(rung)].data(); }

std::optional<Rung> find_rung(std::string_view name) {
  const auto found = std::ranges::find(kRungNames, name);
  if (found == kRungNames.begin() || found == kRungNames.end()) return std::nullopt;
  return static_cast<Rung>(found - kRungNames.begin());
}

const FailsafeTraits& traits(FailsafeKind kind) { return kTraits[static_cast<std::size_t>(kind)]; }

std::optional<FailsafeKind> find_failsafe(std::string_view name) {
  const auto found = std::ranges::find(kTraits, name, &FailsafeTraits::name);
  if (found == kTraits.end()) return std::nullopt;
  return found->kind;
}

FailsafePolicies default_policies() {
  FailsafePolicies policies;
  std::ranges::transform(kTraits, policies.begin(), &FailsafeTraits::policy);
  return policies;
}

FailsafeLadder::FailsafeLadder(const FailsafePolicies& policies) {
  for (std::size_t i = 0; i < kFailsafeCount; ++i) watches_[i].policy = policies[i];
}

void FailsafeLadder::advance(Watch& watch, Utime now, bool condition) {
  if (condition) {
    watch.false_since.reset();
    if (!watch.true_since) watch.true_since = now;
    const bool persists = to_seconds(now - *watch.true_since) >= watch.policy.persistence_s;
    if (persists && !watch.active_since) watch.active_since = now;
    return;
  }
  watch.true_since.reset();
  if (!watch.false_since) watch.false_since = now;
  if (to_seconds(now - *watch.false_since) >= watch.policy.clear_s) watch.active_since.reset();
}

// True if the condition has lasted too long for its rung. One that has ended and only waits for
// clear_s has not.
bool FailsafeLadder::is_overdue(const Watch& watch, Utime now, bool may_leave_hold) {
  const Rung rung = watch.policy.rung;
  const bool may = rung == Rung::kReplan || (rung == Rung::kHold && may_leave_hold);
  return may && watch.true_since.has_value() &&
         to_seconds(now - *watch.active_since) >= watch.policy.escalate_s;
}

std::optional<FailsafeLadder::Change> FailsafeLadder::update(Utime now,
                                                             const FailsafeConditions& conditions,
                                                             bool open_above) {
  Change change;
  for (std::size_t i = 0; i < kFailsafeCount; ++i) {
    Watch& watch = watches_[i];
    if (watch.policy.rung == Rung::kNone) continue;
    advance(watch, now, conditions[i]);
    if (!watch.active_since) continue;
    // Without range data the vehicle can still return along its trail.
    const bool may_leave_hold = open_above || static_cast<Kind>(i) == Kind::kRangeLost;
    const bool escalated = is_overdue(watch, now, may_leave_hold);
    const Rung rung = escalated ? Rung::kAbortAndSurface : watch.policy.rung;
    if (rung <= change.rung) continue;
    change.rung = rung;
    change.cause = static_cast<FailsafeKind>(i);
    change.escalated = escalated;
  }
  const bool latched = rung_ >= Rung::kRetrace;
  if (latched && change.rung <= rung_) return std::nullopt;
  // Among failsafes that request the same rung, the first one keeps it.
  const Watch& present = watches_[static_cast<std::size_t>(cause_)];
  const bool stands = rung_ == Rung::kNone ||
                      (present.active_since && (present.policy.rung == rung_ || change.escalated));
  if (change.rung == rung_ && stands) return std::nullopt;

  rung_ = change.rung;
  cause_ = change.rung == Rung::kNone ? cause_ : change.cause;
  change.cause = cause_;
  for (std::size_t i = 0; i < kFailsafeCount; ++i) {
    const auto kind = static_cast<FailsafeKind>(i);
    if (watches_[i].active_since && kind != cause_) change.competing.push_back(kind);
  }
  return change;
}

}  // namespace dive::behaviors
