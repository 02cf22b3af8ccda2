#include "behaviors/retrace.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "vehicle/going_home.h"

namespace dive::behaviors {
namespace {

constexpr double kLeastRadius = 0.1;  // m, at the end of a short path
constexpr double kPathGrace = 60.0;   // s added to kPathSlack times the path's time at full speed
constexpr double kPathSlack = 4.0;
constexpr int kMaxArrivals = 5;  // at places that turn out to have an overhead
// m to swim into open water, if the trail is that long; the shorter ones are for an obstacle that
// waits at its end
constexpr double kFarthestBeyond = 1.0;
constexpr std::array<double, 3> kShorterBeyond = {0.6, 0.3, 0.0};
constexpr double kMaxDriftAtRest = 0.08;  // m/s
constexpr double kStopsWithin = 4.0;      // s after which it has stopped, whatever the estimate
constexpr double kLevel = 0.15;           // rad of tilt
constexpr double kStillTurning = 0.2;     // rad/s
constexpr double kLevelSeconds = 4.0;     // s after which it is level
constexpr double kBearingFrom = 1.0;      // m: distance of the first point that gives a bearing
constexpr double kTrustingShare = 0.5;    // of the speed, on a trail that seems blocked
constexpr double kAhead = 15.0;           // m of the path that are checked at a time

const char* to_string(retrace::Loss cause) {
  switch (cause) {
    case retrace::Loss::kBlocked:
      return "the trail is blocked";
    case retrace::Loss::kUnobservable:
      return "the planned path enters space that the sensor cannot observe";
    case retrace::Loss::kNoProgress:
      return "the vehicle makes no progress along its trail";
  }
  return "none";
}

// The first waypoints of `path`, up to a length of about `max_m`.
std::span<const Pose> first_part(std::span<const Pose> path, double max_m) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    length += (path[i].p - path[i - 1].p).norm();
    if (length >= max_m) return path.first(i + 1);
  }
  return path;
}

// A short path has a smaller radius: while the vehicle turns, it is not at its end yet.
vehicle::FollowerOptions follower_options(double speed, double length_m) {
  vehicle::FollowerOptions options;
  options.speed = speed;
  options.capture_radius = vehicle::kHomeCaptureRadius;
  options.last_capture_radius =
      std::clamp(0.5 * length_m, kLeastRadius, vehicle::kHomeCaptureRadius);
  return options;
}

}  // namespace

Retrace::Retrace(const Trail& trail, const LegSettings& settings, PathEvaluator* changes)
    : trail_(trail),
      changes_(changes),
      settings_(settings),
      recovery_(settings.limits.clearance, settings.recovery),
      follower_(follower_options(settings.speed, 0.0)) {
  progress_.goal = "open water";
}

BehaviorOutput Retrace::step(const BehaviorInput& input) {
  if (!since_) since_ = input.now;
  BehaviorOutput output;
  output.command = station(input.estimate->X_WB);
  if (!input.attitude_known) {
    since_ = input.now;             // time without attitude does not count
    output.done = input.can_go_up;  // without attitude it cannot reach a better place
    return output;
  }
  if (input.can_go_up && is_stopping()) {
    output.command.o = stopping_attitude(*input.estimate);
    output.done = has_stopped(input);
    return output;
  }
  take_answer(input);
  if (input.trail_moved && std::holds_alternative<retrace::FollowingTrail>(state_)) {
    begin_trail(input);
  }
  run(input, output, std::exchange(alternative_requested_, false));
  return output;
}

void Retrace::run(const BehaviorInput& input, BehaviorOutput& output, bool wants_alternative) {
  if (auto* state = std::get_if<retrace::Stopping>(&state_)) return stop(*state, input, output);
  if (auto* state = std::get_if<retrace::Levelling>(&state_)) {
    return come_level(state->since, input, output);
  }
  if (auto* state = std::get_if<retrace::FollowingTrail>(&state_)) {
    return follow(state->allowed_s, input, output);
  }
  if (auto* state = std::get_if<retrace::FollowingDetour>(&state_)) {
    return follow(state->allowed_s, input, output, wants_alternative);
  }
  if (auto* state = std::get_if<retrace::TrustingTrail>(&state_)) {
    return follow(state->allowed_s, input, output);
  }
  if (auto* state = std::get_if<retrace::ObservingTrail>(&state_)) {
    return observe_trail(state->since, input, output);
  }
  if (auto* state = std::get_if<retrace::PlanningDetour>(&state_)) {
    return plan_detour(state->cause, input, output);
  }
  if (std::holds_alternative<retrace::Arrived>(state_)) {
    begin_trail(input);
    return run(input, output);
  }
  output.failed = Failure::kExhausted;  // NoWayOut
}

// Before it turns back, or at the end of its path.
bool Retrace::is_stopping() const {
  return std::holds_alternative<retrace::Stopping>(state_) ||
         std::holds_alternative<retrace::Levelling>(state_) ||
         std::holds_alternative<retrace::Arrived>(state_);
}

// A vehicle that coasts under an overhead must not mistake its edge for open water.
bool Retrace::has_stopped(const BehaviorInput& input) const {
  return input.estimate->v_WB_B.norm() < kMaxDriftAtRest ||
         to_seconds(input.now - *since_) > kStopsWithin;
}

Eigen::Quaterniond Retrace::stopping_attitude(const estimation::StateEstimate& estimate) {
  return from_rpy(0.0, 0.0, drift_stop_.heading(estimate.X_WB.q, estimate.v_WB_B));
}

// A turn at speed, or on its side, takes the vehicle off the trail and makes its position estimate
// wrong.
void Retrace::stop(retrace::Stopping& stopping, const BehaviorInput& input,
                   BehaviorOutput& output) {
  const Pose& X_WB = input.estimate->X_WB;
  if (!stopping.q_WB) stopping.q_WB = X_WB.q;
  output.command.o = *stopping.q_WB;
  if (!has_stopped(input)) return;
  station_.reset();
  output.command = station(X_WB);
  raise(retrace::Stopped{input.now});
  run(input, output);
}

void Retrace::come_level(Utime since, const BehaviorInput& input, BehaviorOutput& output) {
  const estimation::StateEstimate& estimate = *input.estimate;
  output.command.o = stopping_attitude(estimate);
  const double upright = (estimate.X_WB.q * Eigen::Vector3d::UnitZ()).z();
  const bool is_level = upright > std::cos(kLevel) && estimate.omega_WB_B.norm() < kStillTurning;
  if (!is_level && to_seconds(input.now - since) <= kLevelSeconds) return;
  begin_trail(input);
  run(input, output);
}

// Sets the path to the rest of the trail. False if it leads to no open water.
bool Retrace::find_trail(const BehaviorInput& input, double speed) {
  is_off_trail_ = false;
  since_ = input.now;
  const Eigen::Vector3d& p_W = input.estimate->X_WB.p;
  const Trail::Path path = path_along_trail(p_W);
  progress_.distance_to_go_m = path.length_m;
  if (!path.arrives) return false;
  out_W_ = path.points.back();
  set_path(level_poses(path.points), path.length_m, speed, p_W);
  return true;
}

void Retrace::begin_trail(const BehaviorInput& input) {
  if (!find_trail(input, settings_.speed)) return raise(retrace::TrailEndless{});
  raise(retrace::TrailFound{time_allowed_s(progress_.distance_to_go_m)});
  if (changes_ != nullptr && is_blocked(*changes_)) lose_path(retrace::Loss::kBlocked, input);
}

bool Retrace::is_inside_an_obstacle(const Pose& X_WB) const {
  return changes_ != nullptr && changes_->clearance_to_all({&X_WB, 1}) <= 0.0;
}

void Retrace::trust_trail(const BehaviorInput& input, BehaviorOutput& output) {
  recovery_.trust_begun(input.now);
  if (!find_trail(input, kTrustingShare * settings_.speed)) {
    raise(retrace::TrailEndless{});
  } else {
    raise(retrace::NoDetour{time_allowed_s(progress_.distance_to_go_m)});
  }
  run(input, output);
}

void Retrace::set_path(std::span<const Pose> waypoints, double length_m, double speed,
                       const Eigen::Vector3d& p_W) {
  follower_ = vehicle::Follower(follower_options(speed, length_m));
  follower_.set_path(waypoints, p_W);
  progress_.path_is_blocked = false;
}

// The farthest path whose end is D_min away from what has appeared; where none is, the one with the
// most clearance there: the position is less certain at the end of a retrace than in a plan.
Trail::Path Retrace::path_along_trail(const Eigen::Vector3d& p_W) const {
  const double link = kTrailLinkShare * settings_.limits.clearance;
  Trail::Path best = trail_.exit_path(p_W, link, kFarthestBeyond);
  if (changes_ == nullptr || recovery_.is_patient()) return best;
  double most = clearance_at_end(best);
  for (const double beyond : kShorterBeyond) {
    if (most >= settings_.limits.clearance) break;
    Trail::Path path = trail_.exit_path(p_W, link, beyond);
    const double clearance = clearance_at_end(path);
    if (clearance <= most) continue;
    most = clearance;
    best = std::move(path);
  }
  return best;
}

// Clearance at the end of the path to what has appeared, m. A path that does not arrive, or has no
// length, has no end to be better than another.
double Retrace::clearance_at_end(const Trail::Path& path) const {
  if (!path.arrives || path.points.size() < 2) return std::numeric_limits<double>::infinity();
  const std::vector<Pose> poses = level_poses(path.points);
  return changes_->clearance(std::span(poses).last(2));
}

double Retrace::time_allowed_s(double length_m) const {
  return kPathGrace + kPathSlack * length_m / settings_.speed;
}

void Retrace::follow(double allowed_s, const BehaviorInput& input, BehaviorOutput& output,
                     bool wants_alternative) {
  const bool is_too_slow = to_seconds(input.now - *since_) > allowed_s;
  std::optional<retrace::Loss> loss;
  if (is_too_slow) loss = retrace::Loss::kNoProgress;
  if (wants_alternative) loss = retrace::Loss::kUnobservable;
  const bool is_due = check_.is_due(input);
  progress_.trusts_trail = std::holds_alternative<retrace::TrustingTrail>(state_);
  if (!progress_.trusts_trail && is_due && input.observed != nullptr &&
      is_blocked(*input.observed)) {
    loss = retrace::Loss::kBlocked;
  }
  if (input.obstacle_ahead) loss = retrace::Loss::kBlocked;
  if (loss) {
    lose_path(*loss, input);
    return run(input, output);
  }
  station_.reset();  // it moves now
  output.command = follower_.step(input.estimate->X_WB, input.estimate->v_WB_B, input.current_W);
  const vehicle::FollowerStatus& status = follower_.status();
  progress_.distance_to_go_m = status.distance_to_go_m;
  progress_.cross_track_m = status.cross_track_m;
  progress_.segment = status.segment;
  if (status.finished) arrive(input, output);
}

void Retrace::way_ahead(const Pose& X_WB, double seconds, std::vector<Pose>& way) const {
  const bool follows = std::holds_alternative<retrace::FollowingTrail>(state_) ||
                       std::holds_alternative<retrace::FollowingDetour>(state_) ||
                       std::holds_alternative<retrace::TrustingTrail>(state_);
  if (!follows) return way.clear();
  follower_.way_ahead(X_WB, seconds * settings_.speed, way);
}

// Arrives if the vehicle comes to rest with open water above; else continues to open water.
void Retrace::arrive(const BehaviorInput& input, BehaviorOutput& output) {
  const bool leads_to_trail = recovery_.is_patient() && is_off_trail_;
  if (!leads_to_trail && ++arrivals_ > kMaxArrivals) output.failed = Failure::kExhausted;
  since_ = input.now;
  drift_stop_.reset();
  raise(retrace::EndReached{});
}

// The rest of the path, up to kAhead.
bool Retrace::is_blocked(PathEvaluator& changes) const {
  const auto behind = static_cast<std::size_t>(follower_.status().segment - 1);
  const double clearance = changes.clearance(first_part(follower_.path().subspan(behind), kAhead));
  return clearance <= (is_off_trail_ ? 0.0 : recovery_.needed_on_trail_m());
}

// True if an obstacle on the path may move away.
void Retrace::lose_path(retrace::Loss cause, const BehaviorInput& input) {
  recovery_.path_lost(input.estimate->X_WB.p);
  if (cause == retrace::Loss::kBlocked) progress_.path_is_blocked = true;
  station_.reset();
  const bool trusted = std::holds_alternative<retrace::TrustingTrail>(state_);
  if (trusted || (cause == retrace::Loss::kBlocked && recovery_.observes_first())) {
    return begin_observation(input);
  }
  raise(retrace::PathLost{cause});
}

// The present place, for as long as it is kept.
vehicle::Command& Retrace::station(const Pose& X_WB) {
  if (!station_) station_ = station_keeping(std::max(-X_WB.p.z(), 0.0), to_rpy(X_WB.q).z());
  return *station_;
}

// Bow towards the trail's exit: the map drops an obstacle once the sensor observes free space
// there.
void Retrace::begin_observation(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  recovery_.observation_begun(X_WB.p, input.now);
  raise(retrace::ObservationBegun{input.now});
  vehicle::Command& station_here = station(X_WB);
  for (const Eigen::Vector3d& place_W : path_along_trail(X_WB.p).points) {
    const Eigen::Vector3d direction = place_W - X_WB.p;
    if (direction.head<2>().norm() < kBearingFrom) continue;
    station_here.o = from_rpy(0.0, 0.0, std::atan2(direction.y(), direction.x()));
    return;
  }
}

void Retrace::observe_trail(Utime since, const BehaviorInput& input, BehaviorOutput& output) {
  output.command = station(input.estimate->X_WB);
  if (recovery_.gives_up(input.now)) {
    output.failed = Failure::kExhausted;
  } else if (recovery_.is_observed(since, input.now)) {
    recovery_.observation_ended();
    begin_trail(input);
  }
}

void Retrace::take_answer(const BehaviorInput& input) {
  const PlanClient::Event answer = planner_.update(input);
  if (answer == PlanClient::Event::kFailed) {
    ++progress_.plan_failures;
    progress_.plan_failure = planner_.reason();
  }
  if (answer != PlanClient::Event::kPath) return;
  const Eigen::Vector3d& p_W = input.estimate->X_WB.p;
  progress_.plan_failures = 0;
  progress_.plan_failure.clear();
  progress_.clearance_m = input.plan->clearance_m;
  recovery_.detour_found(p_W);
  is_off_trail_ = true;
  since_ = input.now;
  set_path(input.plan->waypoints, input.plan->length_m, settings_.speed, p_W);
  raise(retrace::DetourFound{time_allowed_s(follower_.status().distance_to_go_m)});
}

void Retrace::plan_detour(retrace::Loss cause, const BehaviorInput& input, BehaviorOutput& output) {
  const Pose& X_WB = input.estimate->X_WB;
  output.command = station(X_WB);
  if (planner_.is_pending()) return;
  LegSettings settings = settings_;
  settings.seed += static_cast<std::uint64_t>(recovery_.tries());
  const std::optional<double> clearance = recovery_.next_clearance();
  if (!clearance) {
    if (recovery_.may_trust_trail(is_inside_an_obstacle(X_WB), input.now)) {
      return trust_trail(input, output);
    }
    begin_observation(input);
    return run(input, output);
  }
  settings.limits.clearance = *clearance;
  settings.limits.min_altitude = 0.0;
  LegGoal goal;
  goal.id = progress_.goal;
  aim(X_WB.p, settings, goal);
  output.plan_request = leg_request(settings, goal, X_WB);
  output.plan_cause = to_string(cause);
  planner_.ask(input.now);
}

// The goal of a detour: the end of the trail; if only the trail is known, its first place behind
// the obstacle, or a place a little along it if there is no obstacle.
void Retrace::aim(const Eigen::Vector3d& p_W, LegSettings& settings, LegGoal& goal) const {
  goal.position_W = out_W_;
  if (!recovery_.is_patient() || changes_ == nullptr) return;
  const BlockedTrailOptions& options = settings_.recovery.blocked_trail;
  const std::vector<Pose> trail = level_poses(path_along_trail(p_W).points);
  const std::span<const Pose> near = first_part(trail, kAhead);
  std::size_t behind = first_part(trail, options.skip_m).size() - 1;
  for (std::size_t i = 1; i < near.size(); ++i) {
    if (changes_->clearance(near.subspan(i - 1, 2)) <= 0.0) behind = i + 1;
  }
  if (behind + 1 < trail.size()) goal.position_W = trail[behind].p;
  double highest = p_W.z();
  for (std::size_t i = 0; i <= behind && i < trail.size(); ++i) {
    highest = std::max(highest, trail[i].p.z());
  }
  settings.limits.max_z = std::min(settings.limits.max_z, highest + options.max_rise_m);
}

}  // namespace dive::behaviors
