#include "behaviors/leg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"

namespace dive::behaviors {
namespace {

// What two proofs of the same clearance may differ by: a share of it, and m.
constexpr double kKept = 0.99;
constexpr double kTolerance = 0.005;

// Of what the path was certified with: with less than that on the way that it takes to stop, it is
// not swum on. So much nearer than asked for, BackOff would have the vehicle go back.
constexpr double kLeastRoom = 0.65;
constexpr double kStopSeconds = 3.0;  // at full speed: to be told of it, and to stop

constexpr int kMostBackOffs = 5;          // in a row from one place
constexpr double kBackForAnother = 1.0;   // m, to look for another way
constexpr double kFartherEachTime = 0.7;  // m
constexpr double kNearlyThere = 0.3;      // m from the goal: it is in no direction
constexpr double kRoomToLook = 0.1;       // m that a turn towards the goal must leave
constexpr double kRoomToTurn = 0.4;       // of D_min, that the turn onto a path must leave
constexpr int kFailuresToApproach = 5;    // each time
constexpr double kApproachStep = 0.25;    // m
constexpr double kLookFrom = 2.0;  // m from the goal: who is there, is in view and not in touch
constexpr double kWorthApproaching = 1.0;  // m nearer

double kept(double clearance_m) { return kKept * clearance_m - kTolerance; }

vehicle::FollowerOptions follower_options(const LegSettings& settings, const LegGoal& goal) {
  vehicle::FollowerOptions options;
  options.speed = settings.speed;
  options.capture_radius = goal.capture_radius;
  return options;
}

double length_of(std::span<const Pose> path) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i].p - path[i - 1].p).norm();
  return length;
}

double yaw_of(const Pose& pose) { return to_rpy(pose.q).z(); }

// On the spot, until the bow points along `way`.
std::array<Pose, 2> turn_along(const Eigen::Vector3d& way, const Pose& X_WB) {
  return {X_WB, Pose{X_WB.p, from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()))}};
}

}  // namespace

vehicle::Command station_keeping(double depth_m, double yaw) {
  vehicle::Command command;
  command.d = depth_m;
  command.o = from_rpy(0.0, 0.0, yaw);
  return command;
}

planning::PlanRequest leg_request(const LegSettings& settings, const LegGoal& goal,
                                  const Pose& from_X_WB) {
  planning::PlanRequest request;
  request.start = from_X_WB;
  request.start.p.z() = std::min(request.start.p.z(), settings.max_z);
  if (settings.attitude == planning::AttitudeMode::kHorizontal) {
    request.start.q = from_rpy(0.0, 0.0, yaw_of(from_X_WB));
  }
  const Eigen::Vector3d way = goal.position_W - from_X_WB.p;
  request.goal.p = goal.position_W;
  request.goal.q = from_rpy(0.0, 0.0, goal.yaw.value_or(std::atan2(way.y(), way.x())));
  request.goal_attitude_fixed = goal.yaw.has_value();
  request.attitude = settings.attitude;
  request.clearance = settings.clearance;
  request.min_z = settings.min_z;
  request.min_altitude = settings.min_altitude;
  request.max_z = settings.max_z;
  request.seed = settings.seed;
  request.goal_tolerance = settings.goal_tolerance;
  return request;
}

Leg::Leg(const LegSettings& settings, LegGoal goal)
    : settings_(settings),
      goal_(std::move(goal)),
      follower_(follower_options(settings, goal_)),
      triggers_(settings.replan),
      back_off_(settings.clearance) {
  DIVE_DEMAND(goal_.position_W.allFinite() && goal_.capture_radius > 0.0);
  progress_.leg = goal_.id;
}

BehaviorOutput Leg::step(const BehaviorInput& input) {
  if (!began_) {
    began_ = input.now;
    began_z_ = input.estimate->X_WB.p.z();
  }
  progress_.elapsed_s = to_seconds(input.now - *began_);
  last_W_ = input.estimate->X_WB.p;
  if (input.plan != nullptr && awaiting_plan_) take_answer(input);
  if (awaiting_plan_ && to_seconds(input.now - asked_at_) > kPlanTimeout) {
    plan_failed(input.now, fmt::format("the planner did not answer within {:g} s", kPlanTimeout));
  }
  if (reached_at_) return dwell(input);
  if (settings_.backs_off) {
    if (std::optional<BehaviorOutput> output = back_off(input)) return std::move(*output);
  }
  return follow_on(input);
}

BehaviorOutput Leg::follow_on(const BehaviorInput& input) {
  return following_ ? follow(input) : without_path(input);
}

void Leg::take_answer(const BehaviorInput& input) {
  awaiting_plan_ = false;
  const PlanAnswer& plan = *input.plan;
  if (plan.status != planning::PlanStatus::kSuccess || plan.waypoints.size() < 2) {
    plan_failed(input.now, plan.reason);
    return;  // a path that is being followed stays certified: it is followed on
  }
  // What was planned before something was seen may lead through it.
  const double seen_m = input.seen != nullptr ? input.seen->clearance(plan.waypoints)
                                              : std::numeric_limits<double>::infinity();
  planned_in_vain_ =
      seen_m <= 0.0 || seen_m < kept(std::min(plan.clearance_m, settings_.clearance));
  if (planned_in_vain_) return;
  if (may_go_back() && !has_room_to_turn(input) && go_back(input, kBackForAnother)) return;
  approaching_ = asked_near_;
  if (!approaching_) {
    progress_.plan_failures = approached_after_ = 0;
    progress_.plan_failure.clear();
    way_there_.assign(plan.waypoints.begin(), plan.waypoints.end());
  }
  certified_m_ = plan.clearance_m;
  progress_.clearance_m = std::min(seen_m, plan.clearance_m);
  told_unreachable_ = false;
  follower_.set_path(plan.waypoints, input.estimate->X_WB.p);
  if (progress_.expected_s == 0.0) {
    progress_.expected_s =
        progress_.elapsed_s + length_of(plan.waypoints) / settings_.speed + goal_.dwell_s;
  }
  triggers_.path_started(input.now);
  following_ = true;
  station_.reset();
}

// A path is proved as it is drawn, turning under way; a sharp turn is made on the spot before it.
bool Leg::has_room_to_turn(const BehaviorInput& input) const {
  if (input.seen == nullptr) return true;
  const Pose& X_WB = input.estimate->X_WB;
  for (const Pose& waypoint : input.plan->waypoints) {
    const Eigen::Vector3d way = waypoint.p - X_WB.p;
    if (way.head<2>().norm() < kNearlyThere) continue;
    return input.seen->clearance(turn_along(way, X_WB)) >= kRoomToTurn * settings_.clearance;
  }
  return true;
}

void Leg::plan_failed(Utime now, std::string why) {
  awaiting_plan_ = false;
  ++progress_.plan_failures;
  progress_.plan_failure = std::move(why);
  retry_at_ = now + from_seconds(settings_.retry_s);
}

// From the waypoint that is being left.
std::span<const Pose> Leg::rest_of_path() const {
  const int segment = std::max(follower_.status().segment, 1);
  return follower_.path().subspan(static_cast<std::size_t>(segment) - 1);
}

// The path from the vehicle on, as far as it takes to stop.
std::vector<Pose> Leg::next_of_path(const Pose& X_WB) const {
  std::vector<Pose> next = {X_WB};
  double left = kStopSeconds * settings_.speed;
  for (const Pose& waypoint : rest_of_path().subspan(1)) {
    const double length = (waypoint.p - next.back().p).norm();
    if (length >= left) {
      next.push_back(interpolate(next.back(), waypoint, left / length));
      break;
    }
    next.push_back(waypoint);
    left -= length;
  }
  return next;
}

// What is near the path farther on may have moved by then, or another path been found.
bool Leg::is_cut_off(const BehaviorInput& input, double rest_m) const {
  if (rest_m <= 0.0) return true;
  const double least = kLeastRoom * std::min(certified_m_, settings_.clearance);
  return rest_m < least && input.seen->clearance(next_of_path(input.estimate->X_WB)) < least;
}

// That a path may lead; from where it is there must be a way.
double Leg::highest(const Eigen::Vector3d& p_W) const {
  if (!settings_.max_rise) return settings_.max_z;
  const double level = std::max(began_z_, goal_.position_W.z()) + *settings_.max_rise;
  return std::min(settings_.max_z, std::max(level, p_W.z()));
}

void Leg::ask(const BehaviorInput& input, const char* cause, BehaviorOutput& output,
              const std::optional<Eigen::Vector3d>& near_W) {
  LegGoal goal = goal_;
  if (near_W) {
    goal.position_W = *near_W;
    goal.yaw.reset();
  }
  planning::PlanRequest request = leg_request(settings_, goal, input.estimate->X_WB);
  request.max_z = highest(request.start.p);
  request.seed += requests_;
  if (following_) {
    request.previous.push_back(request.start);
    const std::span<const Pose> ahead = rest_of_path().subspan(1);
    request.previous.insert(request.previous.end(), ahead.begin(), ahead.end());
  }
  ++requests_;
  awaiting_plan_ = true;
  planned_in_vain_ = false;
  asked_near_ = near_W.has_value();
  asked_at_ = input.now;
  output.plan_request = std::move(request);
  output.plan_cause = cause;
}

bool Leg::take_another_way() {
  another_way_ = may_go_back();
  return another_way_;
}

bool Leg::may_go_back() const {
  return settings_.backs_off && back_off_.count_at(last_W_) < kMostBackOffs;
}

// At least so far, and farther each time from one place: what it waits for may take a while, and
// where there is little room it cannot lie still. False when there is no way to more room.
bool Leg::go_back(const BehaviorInput& input, double least_m) {
  BackOff::Asked asked;
  asked.least_m = least_m + kFartherEachTime * back_off_.count_at(input.estimate->X_WB.p);
  if (!back_off_.begin(input, asked)) {
    if (asked.least_m == least_m) return false;
    asked.least_m = least_m;
    if (!back_off_.begin(input, asked)) return false;
  }
  awaiting_plan_ = following_ = false;  // what comes now was planned from where it is not to be
  station_.reset();
  return true;
}

// Nothing when the vehicle has room where it is, or no way back.
std::optional<BehaviorOutput> Leg::back_off(const BehaviorInput& input) {
  BehaviorOutput output;
  if (!back_off_.is_under_way()) {
    const bool is_needed = back_off_.is_needed(input);
    const bool for_another = std::exchange(another_way_, false);
    if (!is_needed && !for_another) return std::nullopt;
    if (!go_back(input, for_another ? kBackForAnother : 0.0)) {
      if (!for_another) return std::nullopt;
      progress_.plan_failure = "the way that was planned leads where it cannot look";
      output = follow_on(input);
      output.failed = Failure::kUnreachable;
      return output;
    }
    if (back_off_.count_at(input.estimate->X_WB.p) > kMostBackOffs && !told_unreachable_) {
      told_unreachable_ = true;
      progress_.plan_failure = "the way there has too little room, again and again";
      output.failed = Failure::kUnreachable;
    }
  }
  const std::optional<vehicle::Command> command = back_off_.follow(input);
  if (!command) return std::nullopt;
  output.command = *command;
  progress_.clearance_m = back_off_.room_m();
  progress_.cross_track_m = 0.0;
  return output;
}

BehaviorOutput Leg::without_path(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  if (!station_) station_ = station_keeping(std::max(-X_WB.p.z(), 0.0), yaw_of(X_WB));
  BehaviorOutput output;
  output.command = *station_;
  progress_.distance_to_go_m = (goal_.position_W - X_WB.p).norm();
  progress_.cross_track_m = 0.0;
  progress_.clearance_m = 0.0;
  if (progress_.plan_failures >= settings_.unreachable_after && !told_unreachable_) {
    told_unreachable_ = true;
    output.failed = Failure::kUnreachable;
    return output;
  }
  if (awaiting_plan_ || (retry_at_ && input.now < *retry_at_)) return output;
  if (requests_ > 0 && !triggers_.take_one()) {
    output.failed = Failure::kExhausted;
    return output;
  }
  if (settings_.backs_off && progress_.plan_failures > 0) look_at_goal(input);
  output.command = *station_;
  if (settings_.backs_off && progress_.plan_failures >= approached_after_ + kFailuresToApproach) {
    approached_after_ = progress_.plan_failures;
    if (const auto near_W = nearest_on_the_way(input)) {
      ask(input, "the goal cannot be had: looks from nearer", output, near_W);
      return output;
    }
  }
  ask(input, requests_ == 0 ? "the leg begins" : "there is no path", output);
  return output;
}

// The last way there, or where there never was one the straight line, as far as there is room.
std::optional<Eigen::Vector3d> Leg::nearest_on_the_way(const BehaviorInput& input) const {
  if (input.seen == nullptr) return std::nullopt;
  const Pose& X_WB = input.estimate->X_WB;
  std::vector<Pose> way = way_there_;
  if (way.empty()) way = {X_WB, Pose{goal_.position_W, X_WB.q}};
  for (std::size_t i = way.size() - 1; i > 0; --i) {
    const Eigen::Vector3d leg = way[i - 1].p - way[i].p;
    const int steps = std::max(static_cast<int>(leg.norm() / kApproachStep), 1);
    for (int k = 1; k <= steps; ++k) {
      const Pose there{way[i].p + leg * k / steps, way[i].q};
      if ((there.p - goal_.position_W).norm() < kLookFrom) continue;
      if (input.seen->clearance({&there, 1}) < settings_.clearance) continue;
      if ((there.p - X_WB.p).norm() < kWorthApproaching) return std::nullopt;
      return there.p;
    }
  }
  return std::nullopt;
}

// What is remembered of somebody who was there goes when it is seen through.
void Leg::look_at_goal(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  const Eigen::Vector3d way = goal_.position_W - X_WB.p;
  if (way.head<2>().norm() < kNearlyThere) return;
  const std::array<Pose, 2> turn = turn_along(way, X_WB);
  if (input.seen != nullptr && input.seen->clearance(turn) < kRoomToLook) return;
  station_->o = turn.back().q;
}

ReplanSignals Leg::signals(const BehaviorInput& input) {
  ReplanSignals signals;
  signals.deviation_m = progress_.cross_track_m;
  signals.distance_to_go_m = progress_.distance_to_go_m;
  signals.demanded = input.replan;
  signals.estimator_switched = estimator_ && *estimator_ != input.estimate->source;
  estimator_ = input.estimate->source;
  if (input.map_changed && input.seen != nullptr) {
    const double clearance = input.seen->clearance(rest_of_path());
    signals.new_clearance_m = clearance;
    signals.path_blocked = clearance < kept(settings_.clearance);
    progress_.clearance_m = std::min(certified_m_, clearance);
  }
  return signals;
}

BehaviorOutput Leg::follow(const BehaviorInput& input) {
  const estimation::StateEstimate& estimate = *input.estimate;
  BehaviorOutput output;
  output.command = follower_.step(estimate.X_WB, estimate.v_WB_B);
  const vehicle::FollowerStatus& status = follower_.status();
  progress_.distance_to_go_m = status.distance_to_go_m;
  progress_.cross_track_m = status.cross_track_m;
  progress_.segment = status.segment;

  if (status.finished && !status.missed && !approaching_) {
    reached_at_ = input.now;
    station_ = station_keeping(-goal_.position_W.z(), yaw_of(estimate.X_WB));
    return dwell(input);
  }
  const ReplanSignals now = signals(input);
  // Only near the goal, or passed it too far off, or something is in the way.
  if (status.finished || (now.new_clearance_m && is_cut_off(input, *now.new_clearance_m))) {
    following_ = false;
    return without_path(input);
  }
  const bool retrying = retry_at_ && input.now < *retry_at_;
  if (planned_in_vain_ && !awaiting_plan_) {
    planned_in_vain_ = false;
    if (triggers_.take_one()) ask(input, "the map changed meanwhile", output);
    return output;
  }
  const ReplanCause cause =
      awaiting_plan_ || retrying ? ReplanCause::kNone : triggers_.update(input.now, now);
  if (cause != ReplanCause::kNone) ask(input, to_string(cause), output);
  return output;
}

BehaviorOutput Leg::dwell(const BehaviorInput& input) {
  BehaviorOutput output;
  output.command = *station_;
  progress_.distance_to_go_m = 0.0;
  output.done = to_seconds(input.now - *reached_at_) >= goal_.dwell_s;
  return output;
}

}  // namespace dive::behaviors
