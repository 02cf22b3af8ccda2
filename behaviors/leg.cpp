#include "behaviors/leg.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "behaviors/trail.h"
#include "common/assert.h"
#include "common/ground_speed.h"

namespace dive::behaviors {
namespace {

// Difference that two proofs of the same clearance may have: a share of it, and m.
constexpr double kKept = 0.99;
constexpr double kTolerance = 0.005;

constexpr double kWorthReplanning = 0.1;  // m by which a path is longer than the straight line

constexpr double kStopSeconds = 3.0;  // at full speed: to receive an obstacle, and to stop

double kept(double clearance_m) { return kKept * clearance_m - kTolerance; }

vehicle::FollowerOptions follower_options(const LegSettings& settings, const LegGoal& goal) {
  vehicle::FollowerOptions options;
  options.speed = settings.speed;
  options.capture_radius = goal.capture_radius;
  return options;
}

vehicle::Command hold_here(const Pose& X_WB) {
  return station_keeping(std::max(-X_WB.p.z(), 0.0), yaw_of(X_WB));
}

// Limits of a path from the height `z` of a leg that began at `began_z`, m. The vehicle may always
// start where it is.
planning::MotionLimits path_limits(const LegSettings& settings, double began_z, const LegGoal& goal,
                                   double z) {
  planning::MotionLimits limits = settings.limits;
  const double goal_z = goal.position_W.z();
  if (settings.max_rise) {
    const double level = std::max(began_z, goal_z) + *settings.max_rise;
    limits.max_z = std::min(limits.max_z, std::max(level, z));
  }
  if (settings.max_drop) {
    const double level = std::min(began_z, goal_z) - *settings.max_drop;
    limits.min_z = std::max(limits.min_z, std::min(level, z));
  }
  return limits;
}

}  // namespace

vehicle::Command station_keeping(double depth_m, double yaw) {
  vehicle::Command command;
  command.d = depth_m;
  command.o = from_rpy(0.0, 0.0, yaw);
  return command;
}

planning::PlanRequest leg_request(const LegSettings& settings, const LegGoal& goal,
                                  const Pose& from_X_WB, const Trail* trail) {
  planning::PlanRequest request;
  request.start = from_X_WB;
  request.start.p.z() = std::min(request.start.p.z(), settings.limits.max_z);
  if (settings.limits.attitude == planning::AttitudeMode::kHorizontal) {
    request.start.q = from_rpy(0.0, 0.0, yaw_of(from_X_WB));
  }
  const Eigen::Vector3d direction = goal.position_W - from_X_WB.p;
  request.goal.p = goal.position_W;
  request.goal.q = from_rpy(0.0, 0.0, goal.yaw.value_or(std::atan2(direction.y(), direction.x())));
  request.goal_attitude_fixed = goal.yaw.has_value();
  request.limits = path_limits(settings, request.start.p.z(), goal, request.start.p.z());
  request.seed = settings.seed;
  if (trail != nullptr) {
    request.trail = trail_to(*trail, request.start.p, request.goal.p,
                             kTrailLinkShare * settings.limits.clearance);
  }
  return request;
}

Leg::Leg(const LegSettings& settings, LegGoal goal)
    : settings_(settings),
      goal_(std::move(goal)),
      recovery_(settings.limits.clearance, settings.recovery),
      follower_(follower_options(settings, goal_)),
      triggers_(settings.replan) {
  DIVE_DEMAND(goal_.position_W.allFinite() && goal_.capture_radius > 0.0);
  progress_.goal = goal_.id;
}

BehaviorOutput Leg::step(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  if (!began_) {
    began_ = input.now;
    began_z_ = X_WB.p.z();
    state_ = leg::Planning{hold_here(X_WB)};
  }
  progress_.elapsed_s = to_seconds(input.now - *began_);
  p_W_ = X_WB.p;
  map_opened_ |= input.map_opened;
  const bool is_outdated = take_answer(input);
  const Failure failure = back_off_if_needed(input);
  BehaviorOutput output = run(input, is_outdated);
  if (failure != Failure::kNone) output.failed = failure;
  return output;
}

BehaviorOutput Leg::run(const BehaviorInput& input, bool is_outdated) {
  if (auto* state = std::get_if<leg::Planning>(&state_)) return plan(*state, input);
  if (auto* state = std::get_if<leg::Following>(&state_)) {
    return follow(state->certified_m, input, is_outdated);
  }
  if (auto* state = std::get_if<leg::Approaching>(&state_)) {
    return follow(state->certified_m, input, is_outdated);
  }
  if (auto* state = std::get_if<leg::Dwelling>(&state_)) return dwell(*state, input);
  return back_off(input);
}

bool Leg::is_backing_off() const { return std::holds_alternative<leg::BackingOff>(state_); }

bool Leg::is_following() const {
  return std::holds_alternative<leg::Following>(state_) ||
         std::holds_alternative<leg::Approaching>(state_);
}

// True if the answer is a path that keeps its clearance from obstacles mapped since the request.
bool Leg::take_answer(const BehaviorInput& input) {
  const PlanClient::Event answer = planner_.update(input);
  if (answer == PlanClient::Event::kFailed) {
    // The path being followed stays certified, so that it is kept.
    recovery_.plan_failed(input.now);
    if (!is_following()) need_ = "the planner has found no path";
    progress_.plan_failures = recovery_.failures();
    progress_.plan_failure = planner_.reason();
  }
  if (answer != PlanClient::Event::kPath) return false;
  const planning::PlanResult& plan = *input.plan;
  const double observed_m = input.observed != nullptr ? input.observed->clearance(plan.waypoints)
                                                      : std::numeric_limits<double>::infinity();
  if (observed_m <= 0.0 ||
      observed_m < kept(std::min(plan.clearance_m, settings_.limits.clearance)))
    return true;
  using TurnOnto = LegRecovery::TurnOnto;
  const TurnOnto turn = recovery_.turn_onto(plan.waypoints, input);
  const bool keeps_path = is_following() && !settings_.recovery.by_motion;
  if (turn == TurnOnto::kAfterStop || (turn == TurnOnto::kNoRoom && keeps_path)) {
    recovery_.path_refused(input.now);
    if (is_following() && progress_.path_is_blocked) {
      raise(leg::PathEnded{stop_here(input)});
    }
    if (!is_following()) {
      need_ = "the planned path began with a turn for which the vehicle stops first";
    }
    return false;
  }
  if (turn == TurnOnto::kNoRoom && recovery_.may_back_off(input.estimate->X_WB.p) &&
      begin_back_off(input, LegRecovery::BackOffReason::kNoRoom))
    return false;
  take_path(input, std::min(observed_m, plan.clearance_m));
  return false;
}

void Leg::take_path(const BehaviorInput& input, double clearance_m) {
  progress_.path_is_blocked = false;
  need_ = "the path is blocked or has ended";
  const planning::PlanResult& plan = *input.plan;
  const auto* planning = std::get_if<leg::Planning>(&state_);
  const bool leads_to_goal = planning == nullptr || !planning->is_to_observe;
  recovery_.path_found(leads_to_goal);
  if (leads_to_goal) {
    progress_.plan_failures = recovery_.failures();
    progress_.plan_failure.clear();
    route_to_goal_.assign(plan.waypoints.begin(), plan.waypoints.end());
    raise(leg::PathToGoal{plan.clearance_m});
  } else {
    raise(leg::PathToObserve{plan.clearance_m});
  }
  progress_.clearance_m = rest_m_ = clearance_m;
  follower_.set_path(plan.waypoints, input.estimate->X_WB.p);
  if (progress_.expected_s == 0.0) {
    progress_.expected_s = progress_.elapsed_s +
                           swim_time_s(plan.waypoints, settings_.speed, input.current_W) +
                           goal_.dwell_s;
  }
  triggers_.path_started(input.now);
}

bool Leg::request_alternative() {
  alternative_requested_ = settings_.recovery.by_motion && recovery_.may_back_off(p_W_);
  return alternative_requested_;
}

Failure Leg::back_off_if_needed(const BehaviorInput& input) {
  if (is_backing_off() || std::holds_alternative<leg::Dwelling>(state_)) return Failure::kNone;
  using Reason = LegRecovery::BackOffReason;
  const bool is_too_near =
      recovery_.is_too_near(input) && !leaves_obstacle(way_to_stop(input), input);
  const bool wants_alternative = std::exchange(alternative_requested_, false);
  if (!is_too_near && !wants_alternative) return Failure::kNone;
  if (!begin_back_off(input, wants_alternative ? Reason::kOtherPath : Reason::kTooNear)) {
    if (!wants_alternative) return Failure::kNone;
    progress_.plan_failure = "the planned path enters space that the sensor cannot observe";
    return Failure::kUnreachable;
  }
  if (!recovery_.reports_too_many(input.estimate->X_WB.p)) return Failure::kNone;
  progress_.plan_failure = "not enough clearance on the path, after several attempts";
  return Failure::kUnreachable;
}

// The path leads past something, and on away from it: neither a stop nor a return would gain any
// clearance. In an unknown environment more of it may be observed ahead.
bool Leg::leaves_obstacle(std::span<const Pose> way, const BehaviorInput& input) const {
  if (way.empty() || settings_.recovery.by_motion) return false;
  const double here_m = input.observed->clearance_to_all({&way.front(), 1});
  const double gain_m = settings_.recovery.back_off.min_gain_m;
  return input.observed->clearance_to_all({&way.back(), 1}) > here_m + gain_m &&
         input.observed->clearance_to_all(way) > here_m - gain_m;
}

// Empty while it follows no path.
std::vector<Pose> Leg::way_to_stop(const BehaviorInput& input) const {
  std::vector<Pose> way;
  way_ahead(input.estimate->X_WB, kStopSeconds, way);
  return way;
}

bool Leg::begin_back_off(const BehaviorInput& input, LegRecovery::BackOffReason reason) {
  if (!recovery_.begin_back_off(input, reason)) return false;
  planner_.cancel();  // its path would start at a place that the vehicle has left
  raise(leg::BackOffBegun{});
  return true;
}

BehaviorOutput Leg::back_off(const BehaviorInput& input) {
  const std::optional<vehicle::Command> command = recovery_.back_off(input);
  if (!command) {
    raise(leg::BackOffEnded{hold_here(input.estimate->X_WB)});
    return run(input);
  }
  BehaviorOutput output;
  output.command = *command;
  output.brakes = true;  // there is no room to coast
  progress_.clearance_m = recovery_.clearance_m();
  progress_.cross_track_m = 0.0;
  return output;
}

BehaviorOutput Leg::plan(leg::Planning& planning, const BehaviorInput& input) {
  BehaviorOutput output;
  output.command = planning.station;
  output.brakes = planning.brakes;
  progress_.distance_to_go_m = (goal_.position_W - input.estimate->X_WB.p).norm();
  progress_.cross_track_m = 0.0;
  progress_.clearance_m = 0.0;
  if (recovery_.reports_unreachable()) {
    output.failed = Failure::kUnreachable;
    return output;
  }
  if (planner_.is_pending() || recovery_.is_pausing(input.now)) return output;
  if (requests_ > 0 && !triggers_.take_one()) {
    output.failed = Failure::kExhausted;
    return output;
  }
  if (const auto attitude = recovery_.attitude_to_observe(input, goal_.position_W)) {
    planning.station.o = *attitude;
    output.command = planning.station;
  }
  const auto place_W = recovery_.place_to_observe(input, goal_.position_W, route_to_goal_);
  planning.is_to_observe = place_W.has_value();
  const char* cause = need_;
  if (place_W) cause = "goal blocked: moving closer to observe it";
  ask(input, cause, output, place_W);
  return output;
}

BehaviorOutput Leg::follow(double certified_m, const BehaviorInput& input, bool is_outdated) {
  const estimation::StateEstimate& estimate = *input.estimate;
  BehaviorOutput output;
  output.command = follower_.step(estimate.X_WB, estimate.v_WB_B, input.current_W);
  const vehicle::FollowerStatus& status = follower_.status();
  progress_.distance_to_go_m = status.distance_to_go_m;
  progress_.cross_track_m = status.cross_track_m;
  progress_.segment = status.segment;

  const bool leads_to_goal = std::holds_alternative<leg::Following>(state_);
  if (leads_to_goal && status.finished && !status.missed) {
    planner_.cancel();
    raise(
        leg::GoalReached{station_keeping(-goal_.position_W.z(), yaw_of(estimate.X_WB)), input.now});
    return run(input);
  }
  if (input.obstacle_ahead) return stop_for_obstacle(input);
  const ReplanSignals now = signals(input, certified_m);
  if (status.finished || is_cut_off(input, certified_m)) {
    raise(leg::PathEnded{stop_here(input)});
    return run(input);
  }
  if (is_outdated) {
    if (triggers_.take_one()) ask(input, "the map changed during planning", output);
    return output;
  }
  if (planner_.is_pending() || recovery_.is_pausing(input.now)) return output;
  const ReplanCause cause = triggers_.update(input.now, now);
  if (cause != ReplanCause::kNone) ask(input, to_string(cause), output);
  return output;
}

vehicle::Command Leg::stop_here(const BehaviorInput& input) const {
  const Pose& X_WB = input.estimate->X_WB;
  vehicle::Command command = hold_here(X_WB);
  command.o = from_rpy(recovery_.roll_to_stop(input), 0.0, to_rpy(command.o).z());
  return command;
}

// The next plan waits until the map has what the scan shows.
BehaviorOutput Leg::stop_for_obstacle(const BehaviorInput& input) {
  progress_.path_is_blocked = true;
  planner_.cancel();
  const Pose& X_WB = input.estimate->X_WB;
  const bool may_plan = recovery_.stopped_for_obstacle(X_WB.p, input.now);
  raise(leg::PathEnded{stop_here(input)});
  BehaviorOutput output = run(input);
  if (!may_plan) {
    progress_.plan_failure = "scans show an obstacle in the way that no plan leads around";
    output.failed = Failure::kUnreachable;
  }
  return output;
}

BehaviorOutput Leg::dwell(const leg::Dwelling& dwelling, const BehaviorInput& input) {
  BehaviorOutput output;
  output.command = dwelling.station;
  progress_.distance_to_go_m = 0.0;
  output.done = to_seconds(input.now - dwelling.since) >= goal_.dwell_s;
  return output;
}

// `place_W`: a destination other than the goal.
void Leg::ask(const BehaviorInput& input, const char* cause, BehaviorOutput& output,
              const std::optional<Eigen::Vector3d>& place_W) {
  LegGoal goal = goal_;
  if (place_W) {
    goal.position_W = *place_W;
    goal.yaw.reset();
  }
  planning::PlanRequest request = leg_request(settings_, goal, input.estimate->X_WB, input.trail);
  request.limits = path_limits(settings_, began_z_, goal_, request.start.p.z());
  request.seed += requests_;
  if (is_following()) {
    request.previous.push_back(request.start);
    const std::span<const Pose> ahead = rest_of_path().subspan(1);
    request.previous.insert(request.previous.end(), ahead.begin(), ahead.end());
  }
  ++requests_;
  map_opened_ = false;
  planner_.ask(input.now);
  output.plan_request = std::move(request);
  output.plan_cause = cause;
}

// The rest of the path, from the waypoint last passed.
std::span<const Pose> Leg::rest_of_path() const {
  const int segment = std::max(follower_.status().segment, 1);
  return follower_.path().subspan(static_cast<std::size_t>(segment) - 1);
}

void Leg::way_ahead(const Pose& X_WB, double seconds, std::vector<Pose>& way) const {
  if (!is_following()) return way.clear();
  follower_.way_ahead(X_WB, seconds * settings_.speed, way);
}

// Obstacles farther along the path are ignored until the vehicle gets there: they may move, or
// another path may be found.
bool Leg::is_cut_off(const BehaviorInput& input, double certified_m) {
  if (rest_m_ <= 0.0) return true;
  const double least =
      settings_.recovery.back_off.min_clearance * std::min(certified_m, settings_.limits.clearance);
  if (rest_m_ >= least || !check_.is_due(input)) return false;
  const std::vector<Pose> way = way_to_stop(input);
  return input.observed->clearance(way) < least && !leaves_obstacle(way, input);
}

ReplanSignals Leg::signals(const BehaviorInput& input, double certified_m) {
  ReplanSignals signals;
  signals.deviation_m = progress_.cross_track_m;
  signals.distance_to_go_m = progress_.distance_to_go_m;
  signals.demanded = input.replan;
  signals.position_corrected = input.position_corrected;
  signals.estimator_switched = estimator_ && *estimator_ != input.estimate->source;
  estimator_ = input.estimate->source;
  const double straight_m = (goal_.position_W - input.estimate->X_WB.p).norm();
  signals.may_be_shorter =
      map_opened_ && progress_.distance_to_go_m > straight_m + kWorthReplanning;
  if (input.map_changed && input.observed != nullptr) {
    const double clearance = input.observed->clearance(rest_of_path());
    signals.new_clearance_m = rest_m_ = clearance;
    signals.path_blocked = clearance < kept(settings_.limits.clearance);
    progress_.clearance_m = std::min(certified_m, clearance);
    progress_.path_is_blocked |= signals.path_blocked;
  }
  return signals;
}

}  // namespace dive::behaviors
