#include "behaviors/recovery.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/assert.h"
#include "common/range_check.h"

namespace dive::behaviors {
namespace {

constexpr double kNearlyThere = 0.3;    // m: within it a place has no meaningful bearing
constexpr double kApproachStep = 0.25;  // m between the places tried
constexpr double kSameStop = 1.0;       // m between two stops for one obstacle
constexpr int kMaxStops = 4;            // for one obstacle
constexpr double kSteep = 1.0;          // rad of pitch: beyond, roll is hardly defined
constexpr double kSharpTurn = 0.6;      // rad: less is turned under way
constexpr double kTurnAtRest = 1.0;     // rad: more is turned after a stop
constexpr double kSlowEnough = 0.15;    // m/s
constexpr double kCoastSeconds = 0.7;   // s of motion at the present velocity until it has stopped
constexpr double kMapSeconds = 1.2;     // s until the map has what two scans show

// A turn on the spot until the bow points along `direction`.
std::array<Pose, 2> turn_along(const Eigen::Vector3d& direction, const Pose& X_WB) {
  return {X_WB, Pose{X_WB.p, from_rpy(0.0, 0.0, std::atan2(direction.y(), direction.x()))}};
}

// The vehicle stops, then turns on the spot to the attitude q_WB.
std::array<Pose, 3> stop_and_turn(const estimation::StateEstimate& estimate,
                                  const Eigen::Quaterniond& q_WB) {
  const Pose& X_WB = estimate.X_WB;
  const Eigen::Vector3d stop_W = X_WB.p + kCoastSeconds * (X_WB.q * estimate.v_WB_B);
  return {X_WB, Pose{stop_W, X_WB.q}, Pose{stop_W, q_WB}};
}

}  // namespace

std::string RecoveryOptions::validate() const {
  RangeCheck check;
  check("retry_s", retry_s, 0.0, 60.0);
  check("unreachable_after", unreachable_after, 1, 1000);
  check("back_off.min_clearance", back_off.min_clearance, 0.0, planning::kMinStartClearance);
  check("back_off.min_gain_m", back_off.min_gain_m, 0.0, 1.0);
  check("back_off.retry_s", back_off.retry_s, 0.0, 60.0);
  check("back_off.max_distance_m", back_off.max_distance_m, 1.0, 50.0);
  check("back_off.max_distance_to_ascend_m", back_off.max_distance_to_ascend_m, 0.0, 50.0);
  check("back_off.same_place_m", back_off.same_place_m, 0.0, 20.0);
  check("back_off.max_attempts", back_off.max_attempts, 0, 100);
  check("back_off.kept_clearance", back_off.kept_clearance, 0.0, 1.0);
  check("back_off.replan_distance_m", back_off.replan_distance_m, 0.1, 10.0);
  check("back_off.farther_each_time_m", back_off.farther_each_time_m, 0.0, 10.0);
  check("back_off.min_turn_clearance", back_off.min_turn_clearance, 0.0, 1.0);
  check("observe_goal.min_turn_clearance_m", observe_goal.min_turn_clearance_m, 0.0, 5.0);
  check("observe_goal.failures", observe_goal.failures, 1, 1000);
  check("observe_goal.min_distance_m", observe_goal.min_distance_m, 0.5, 20.0);
  check("observe_goal.min_approach_m", observe_goal.min_approach_m, 0.1, 20.0);
  check("blocked_trail.wait_s", blocked_trail.wait_s, 0.0, 3600.0);
  check("blocked_trail.hold_s", blocked_trail.hold_s, 0.0, 3600.0);
  check("blocked_trail.observe_s", blocked_trail.observe_s, 0.1, 60.0);
  check("blocked_trail.observations", blocked_trail.observations, 0, 100);
  check("blocked_trail.observe_again_m", blocked_trail.observe_again_m, 0.1, 50.0);
  check("blocked_trail.min_clearance", blocked_trail.min_clearance, 0.0, 1.0);
  for (const double share : blocked_trail.detour_clearances) {
    check("blocked_trail.detour_clearances", share, 0.01, 1.0);
  }
  check("blocked_trail.progress_m", blocked_trail.progress_m, 0.1, 10.0);
  check("blocked_trail.max_detours", blocked_trail.max_detours, 0, 1000);
  check("blocked_trail.skip_m", blocked_trail.skip_m, 0.5, 15.0);
  check("blocked_trail.max_rise_m", blocked_trail.max_rise_m, 0.0, 5.0);
  return check.problem();
}

LegRecovery::LegRecovery(double d_min_m, const RecoveryOptions& options)
    : d_min_m_(d_min_m), options_(options), back_off_(d_min_m, options.back_off) {
  DIVE_DEMAND(options.validate().empty());
}

void LegRecovery::plan_failed(Utime now) {
  ++failures_;
  ++failures_to_approach_;
  pause_until_ = now + from_seconds(options_.retry_s);
}

bool LegRecovery::stopped_for_obstacle(const Eigen::Vector3d& p_W, Utime now) {
  pause_until_ = now + from_seconds(kMapSeconds);
  if ((p_W - stopped_at_W_).norm() > kSameStop) {
    stops_ = 0;
    stopped_at_W_ = p_W;
  }
  return ++stops_ <= kMaxStops;
}

void LegRecovery::path_found(bool leads_to_goal) {
  if (leads_to_goal) failures_ = failures_to_approach_ = 0;
  is_reported_ = false;
}

bool LegRecovery::reports_unreachable() {
  if (failures_ < options_.unreachable_after || is_reported_) return false;
  is_reported_ = true;
  return true;
}

std::optional<Eigen::Quaterniond> LegRecovery::attitude_to_observe(
    const BehaviorInput& input, const Eigen::Vector3d& goal_W) const {
  if (!options_.by_motion || failures_ == 0) return std::nullopt;
  const Pose& X_WB = input.estimate->X_WB;
  const Eigen::Vector3d direction = goal_W - X_WB.p;
  if (direction.head<2>().norm() < kNearlyThere) return std::nullopt;
  const std::array<Pose, 2> turn = turn_along(direction, X_WB);
  const double least = options_.observe_goal.min_turn_clearance_m;
  if (input.observed != nullptr && input.observed->clearance(turn) < least) return std::nullopt;
  return turn.back().q;
}

std::optional<Eigen::Vector3d> LegRecovery::place_to_observe(const BehaviorInput& input,
                                                             const Eigen::Vector3d& goal_W,
                                                             std::span<const Pose> route) {
  const ObserveGoalOptions& options = options_.observe_goal;
  if (!options_.by_motion || failures_to_approach_ < options.failures) return std::nullopt;
  failures_to_approach_ = 0;
  if (input.observed == nullptr) return std::nullopt;
  const Pose& X_WB = input.estimate->X_WB;
  const std::array<Pose, 2> straight = {X_WB, Pose{goal_W, X_WB.q}};
  if (route.empty()) route = straight;
  for (std::size_t i = route.size() - 1; i > 0; --i) {
    const Eigen::Vector3d back = route[i - 1].p - route[i].p;
    const int steps = std::max(static_cast<int>(back.norm() / kApproachStep), 1);
    for (int k = 1; k <= steps; ++k) {
      const Pose there{route[i].p + back * k / steps, route[i].q};
      if ((there.p - goal_W).norm() < options.min_distance_m) continue;
      if (input.observed->clearance({&there, 1}) < d_min_m_) continue;
      if ((there.p - X_WB.p).norm() < options.min_approach_m) return std::nullopt;
      return there.p;
    }
  }
  return std::nullopt;
}

// On a known map nearness alone may be an error of the position; what the map lacks was observed
// from here.
bool LegRecovery::is_beside_unmapped(const BehaviorInput& input) const {
  const Pose& X_WB = input.estimate->X_WB;
  if (stops_ > 0 && (X_WB.p - stopped_at_W_).norm() <= kSameStop) return true;
  return input.map_changed && input.observed != nullptr &&
         input.observed->clearance({&X_WB, 1}) < options_.back_off.min_clearance * d_min_m_;
}

bool LegRecovery::is_too_near(const BehaviorInput& input) {
  return (options_.by_motion || is_beside_unmapped(input)) && back_off_.is_needed(input);
}

bool LegRecovery::may_back_off(const Eigen::Vector3d& p_W) const {
  return back_off_.count_at(p_W) < options_.back_off.max_attempts;
}

LegRecovery::TurnOnto LegRecovery::turn_onto(std::span<const Pose> path,
                                             const BehaviorInput& input) {
  if (input.observed == nullptr) return TurnOnto::kPossible;
  const Pose& X_WB = input.estimate->X_WB;
  const Eigen::Vector3d& v_B = input.estimate->v_WB_B;
  const auto first = std::ranges::find_if(path, [&](const Pose& waypoint) {
    return (waypoint.p - X_WB.p).head<2>().norm() >= kNearlyThere;
  });
  if (first == path.end()) return TurnOnto::kPossible;
  const Eigen::Vector3d direction = first->p - X_WB.p;
  const double turn = wrap_angle(std::atan2(direction.y(), direction.x()) - to_rpy(X_WB.q).z());
  if (std::abs(turn) < kSharpTurn) return TurnOnto::kPossible;
  if (std::abs(turn) > kTurnAtRest && v_B.norm() > kSlowEnough) return TurnOnto::kAfterStop;
  const Eigen::Quaterniond turned = from_rpy(0.0, 0.0, turn) * X_WB.q;
  turn_clearance_m_ = input.observed->clearance_to_all(stop_and_turn(*input.estimate, turned));
  return turn_clearance_m_ < least_turn_clearance() ? TurnOnto::kNoRoom : TurnOnto::kPossible;
}

double LegRecovery::least_turn_clearance() const {
  return options_.back_off.min_turn_clearance * d_min_m_;
}

double LegRecovery::roll_to_stop(const BehaviorInput& input) const {
  const Eigen::Vector3d rpy = to_rpy(input.estimate->X_WB.q);
  if (std::abs(rpy.y()) > kSteep) return 0.0;
  if (input.observed == nullptr) return rpy.x();
  const Eigen::Quaterniond level = from_rpy(0.0, 0.0, rpy.z());
  const double level_m = input.observed->clearance_to_all(stop_and_turn(*input.estimate, level));
  return level_m < least_turn_clearance() ? rpy.x() : 0.0;
}

void LegRecovery::path_refused(Utime now) { pause_until_ = now + from_seconds(options_.retry_s); }

// The distance grows with each attempt from one place: an obstacle may need time to leave, and with
// little clearance the vehicle cannot keep station.
bool LegRecovery::begin_back_off(const BehaviorInput& input, BackOffReason reason) {
  const int count = back_off_.count_at(input.estimate->X_WB.p);
  BackOff::Criteria nearest;
  if (reason != BackOffReason::kTooNear) {
    nearest.min_distance_m = options_.back_off.replan_distance_m;
  }
  if (reason == BackOffReason::kNoRoom) nearest.min_clearance_m = turn_clearance_m_;
  BackOff::Criteria farther = nearest;
  farther.min_distance_m += options_.back_off.farther_each_time_m * count;
  if (back_off_.begin(input, farther)) return true;
  return farther.min_distance_m > nearest.min_distance_m && back_off_.begin(input, nearest);
}

bool LegRecovery::reports_too_many(const Eigen::Vector3d& p_W) {
  if (back_off_.count_at(p_W) <= options_.back_off.max_attempts || is_reported_) return false;
  is_reported_ = true;
  return true;
}

std::optional<vehicle::Command> LegRecovery::back_off(const BehaviorInput& input) {
  return back_off_.follow(input);
}

TrailRecovery::TrailRecovery(double d_min_m, const RecoveryOptions& options)
    : d_min_m_(d_min_m), options_(options.blocked_trail) {
  DIVE_DEMAND(options.validate().empty());
}

double TrailRecovery::needed_on_trail_m() const {
  return observes_first() ? options_.min_clearance * d_min_m_ : 0.0;
}

// A path around one thing may be blocked by the next.
void TrailRecovery::path_lost(const Eigen::Vector3d& p_W) {
  const bool made_progress = detour_from_W_ && (p_W - *detour_from_W_).norm() > options_.progress_m;
  if (made_progress && detours_ < options_.max_detours) {
    tries_ = 0;
    blocked_since_.reset();
    detour_from_W_.reset();  // progress counts once
  }
  if (observed_from_W_ && (p_W - *observed_from_W_).norm() > options_.observe_again_m) {
    observations_ = 0;
    blocked_since_.reset();
  }
}

bool TrailRecovery::observes_first() const {
  return is_patient() && observations_ < options_.observations;
}

void TrailRecovery::observation_begun(const Eigen::Vector3d& p_W, Utime now) {
  if (!blocked_since_) blocked_since_ = now;
  ++observations_;
  observed_from_W_ = p_W;
}

bool TrailRecovery::is_observed(Utime since, Utime now) const {
  return to_seconds(now - since) >= options_.observe_s;
}

bool TrailRecovery::may_trust_trail(bool is_inside, Utime now) const {
  if (trusted_since_) return to_seconds(now - *trusted_since_) < options_.hold_s;
  return !is_patient() && is_inside;
}

void TrailRecovery::trust_begun(Utime now) {
  if (!trusted_since_) trusted_since_ = now;
}

bool TrailRecovery::gives_up(Utime now) const {
  if (trusted_since_) return to_seconds(now - *trusted_since_) >= options_.hold_s;
  return blocked_since_ && to_seconds(now - *blocked_since_) >= options_.wait_s;
}

std::optional<double> TrailRecovery::next_clearance() {
  const auto& shares = options_.detour_clearances;
  if (tries_ == static_cast<int>(shares.size())) return std::nullopt;
  return shares[static_cast<std::size_t>(tries_++)] * d_min_m_;
}

void TrailRecovery::detour_found(const Eigen::Vector3d& p_W) {
  detour_from_W_ = p_W;
  ++detours_;
}

}  // namespace dive::behaviors
