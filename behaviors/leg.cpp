#include "behaviors/leg.h"

#include <algorithm>
#include <utility>

#include "common/assert.h"

namespace dive::behaviors {
namespace {

vehicle::FollowerOptions follower_options(const LegSettings& settings, const LegGoal& goal) {
  vehicle::FollowerOptions options;
  options.speed = settings.speed;
  options.capture_radius = goal.capture_radius;
  return options;
}

double yaw_of(const Pose& pose) { return to_rpy(pose.q).z(); }

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
  return request;
}

Leg::Leg(const LegSettings& settings, LegGoal goal)
    : settings_(settings),
      goal_(std::move(goal)),
      follower_(follower_options(settings, goal_)),
      triggers_(settings.replan) {
  DIVE_DEMAND(goal_.position_W.allFinite() && goal_.capture_radius > 0.0);
  progress_.leg = goal_.id;
}

BehaviorOutput Leg::step(const BehaviorInput& input) {
  if (input.plan != nullptr && awaiting_plan_) take_answer(input);
  if (reached_at_) return dwell(input);
  return following_ ? follow(input) : without_path(input);
}

void Leg::take_answer(const BehaviorInput& input) {
  awaiting_plan_ = false;
  const PlanAnswer& plan = *input.plan;
  if (plan.status != planning::PlanStatus::kSuccess || plan.waypoints.size() < 2) {
    ++progress_.plan_failures;
    progress_.plan_failure = plan.reason;
    retry_at_ = input.now + from_seconds(settings_.retry_s);
    return;  // a path that is being followed stays certified: it is followed on
  }
  progress_.plan_failures = 0;
  progress_.plan_failure.clear();
  progress_.clearance_m = plan.clearance_m;
  follower_.set_path(plan.waypoints, input.estimate->X_WB.p);
  triggers_.path_started(input.now);
  following_ = true;
  station_.reset();
}

planning::PlanRequest Leg::request(const BehaviorInput& input) {
  planning::PlanRequest request = leg_request(settings_, goal_, input.estimate->X_WB);
  request.seed += requests_;
  if (following_) {
    const std::span<const Pose> path = follower_.path();
    request.previous.push_back(request.start);
    const auto ahead = path.subspan(static_cast<std::size_t>(follower_.status().segment));
    request.previous.insert(request.previous.end(), ahead.begin(), ahead.end());
  }
  ++requests_;
  awaiting_plan_ = true;
  return request;
}

BehaviorOutput Leg::without_path(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  if (!station_) station_ = station_keeping(std::max(-X_WB.p.z(), 0.0), yaw_of(X_WB));
  BehaviorOutput output;
  output.command = *station_;
  progress_.distance_to_go_m = (goal_.position_W - X_WB.p).norm();
  progress_.cross_track_m = 0.0;
  if (awaiting_plan_ || (retry_at_ && input.now < *retry_at_)) return output;
  if (requests_ > 0 && !triggers_.take_one()) {
    output.failed = true;
    return output;
  }
  output.plan_request = request(input);
  return output;
}

BehaviorOutput Leg::follow(const BehaviorInput& input) {
  BehaviorOutput output;
  const estimation::StateEstimate& estimate = *input.estimate;
  output.command = follower_.step(estimate.X_WB, estimate.v_WB_B);
  const vehicle::FollowerStatus& status = follower_.status();
  progress_.distance_to_go_m = status.distance_to_go_m;
  progress_.cross_track_m = status.cross_track_m;
  progress_.segment = status.segment;

  if (status.finished && !status.missed) {
    reached_at_ = input.now;
    station_ = station_keeping(-goal_.position_W.z(), yaw_of(estimate.X_WB));
    return dwell(input);
  }
  if (status.finished) {  // passed the goal too far off: plan from here
    following_ = false;
    return without_path(input);
  }
  const bool retrying = retry_at_ && input.now < *retry_at_;
  if (!awaiting_plan_ && !retrying &&
      triggers_.update(input.now, status.cross_track_m) != ReplanCause::kNone) {
    output.plan_request = request(input);
  }
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
