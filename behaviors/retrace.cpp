#include "behaviors/retrace.h"

#include <algorithm>
#include <array>
#include <utility>

namespace dive::behaviors {
namespace {

constexpr double kCaptureRadius = 0.5;
constexpr double kGraceSeconds = 60.0;
constexpr int kMaxArrivals = 5;       // at places that turn out not to be open
constexpr double kBeyond = 1.0;       // m of open water to be swum into, if the trail has them
constexpr double kAtRest = 0.08;      // m/s
constexpr double kStopSeconds = 4.0;  // it has stopped by then, whatever is estimated
constexpr double kGotOn = 0.5;        // m along a planned way
constexpr int kMaxPlannedWays = 40;
constexpr double kLookedBack = 1.0;   // m along the trail that is looked at ...
constexpr double kLook = 6.0;         // ... s that it takes to look ...
constexpr int kLooksFirst = 3;        // ... so many times before a way round is planned ...
constexpr double kLookAgain = 2.0;    // ... and again after so many m
constexpr double kAhead = 15.0;       // m: farther off it is judged when it comes nearer
constexpr double kPastNothing = 3.0;  // m along a trail on which nothing is in the way
constexpr double kBeside = 0.4;       // of D_min, from the trail to what was seen since
constexpr double kRise = 0.3;         // m above the trail that a way round may lead
constexpr double kSlow = 4.0;         // times the time at full speed is not getting on
// Of D_min, one after the other: what is out of reach with all of it may be had with less.
constexpr std::array<double, 4> kShares = {1.0, 0.6, 0.3, 0.1};

// The first waypoints of `way`: as many as make up `most_m`.
std::span<const Pose> beginning(std::span<const Pose> way, double most_m) {
  double length = 0.0;
  for (std::size_t i = 1; i < way.size(); ++i) {
    length += (way[i].p - way[i - 1].p).norm();
    if (length >= most_m) return way.first(i + 1);
  }
  return way;
}

vehicle::FollowerOptions follower_options(double speed) {
  vehicle::FollowerOptions options;
  options.speed = speed;
  options.capture_radius = kCaptureRadius;
  return options;
}

}  // namespace

Retrace::Retrace(const Trail& trail, const LegSettings& settings, PathJudge* changes)
    : trail_(trail),
      changes_(changes),
      settings_(settings),
      follower_(follower_options(settings.speed)) {
  progress_.leg = "open water";
}

// A vehicle that comes upon a roof must not take its edge for open water while it still coasts.
bool Retrace::has_stopped(const BehaviorInput& input) const {
  return input.estimate->v_WB_B.norm() < kAtRest ||
         to_seconds(input.now - *entered_at_) > kStopSeconds;
}

Trail::Way Retrace::way_along_trail(const Eigen::Vector3d& p_W) const {
  return trail_.way_out(p_W, kTrailLinkShare * settings_.clearance, kBeyond);
}

// Somebody beside the trail is given room; a trail that has no more is swum all the same.
double Retrace::needed_m() const {
  return is_patient() && looks_ < kLooksFirst ? kBeside * settings_.clearance : 0.0;
}

void Retrace::begin(const BehaviorInput& input) {
  begun_ = true;
  on_trail_ = true;
  entered_at_ = input.now;
  const Eigen::Vector3d& p_W = input.estimate->X_WB.p;
  const Trail::Way way = way_along_trail(p_W);
  way_.clear();
  progress_.distance_to_go_m = way.length_m;
  if (!way.arrives || way.points.size() < 2) return;
  way_ = level_poses(way.points);
  out_W_ = way.points.back();
  time_allowed_s_ = kGraceSeconds + kSlow * way.length_m / settings_.speed;
  follower_.set_path(way_, p_W);
  if (changes_ != nullptr) give_up_if_blocked(*changes_, input);
}

void Retrace::give_up_trail(const char* why, const BehaviorInput& input) {
  // In unknown water a way that was good shows to be blocked further on: that one is to be tried
  // anew, and not with less clearance.
  const bool got_on = planned_at_W_ && (input.estimate->X_WB.p - *planned_at_W_).norm() > kGotOn;
  if (got_on && planned_ways_ < kMaxPlannedWays) {
    tries_ = 0;
    blocked_since_.reset();
  }
  if (looked_at_W_ && (input.estimate->X_WB.p - *looked_at_W_).norm() > kLookAgain) {
    looks_ = 0;
    blocked_since_.reset();
  }
  planning_ = true;
  why_ = why;
  station_.reset();
}

// What is left of the way, but for what is far ahead. What blocks it may be somebody who has gone,
// or will go.
void Retrace::give_up_if_blocked(PathJudge& changes, const BehaviorInput& input) {
  const auto behind = static_cast<std::size_t>(follower_.status().segment - 1);
  const double clearance = changes.clearance(beginning(std::span(way_).subspan(behind), kAhead));
  if (clearance > (on_trail_ ? needed_m() : 0.0)) return;
  give_up_trail("the trail is blocked", input);
  if (is_patient() && looks_ < kLooksFirst) look_back(input);
}

// Where it is, as long as it is kept there.
vehicle::Command& Retrace::station(const Pose& X_WB) {
  if (!station_) station_ = station_keeping(std::max(-X_WB.p.z(), 0.0), to_rpy(X_WB.q).z());
  return *station_;
}

BehaviorOutput Retrace::step(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  if (!entered_at_) entered_at_ = input.now;
  BehaviorOutput output;
  output.command = station(X_WB);
  const bool is_crippled = !input.attitude_known || !input.depth_known;
  if (input.can_go_up && (is_crippled || !begun_)) {  // no better place will be found in the dark
    output.done = is_crippled || has_stopped(input);
    return output;
  }
  if (!input.attitude_known) {
    entered_at_ = input.now;  // it does not count
    return output;
  }
  if (!begun_) begin(input);
  if (way_.empty()) {
    output.failed = Failure::kExhausted;
    return output;
  }
  if (input.plan != nullptr && awaiting_plan_) take_answer(input);
  if (!planning_ && input.map_changed && input.seen != nullptr) {
    give_up_if_blocked(*input.seen, input);
  }
  if (std::exchange(cannot_look_, false) && !planning_ && !on_trail_) {
    give_up_trail("the way that was planned leads where it cannot look", input);
  }
  if (!planning_ && to_seconds(input.now - *entered_at_) > time_allowed_s_) {
    give_up_trail("the vehicle does not get on along its trail", input);
  }
  if (looking_since_) return wait(input);
  return planning_ ? plan_out(input) : follow(input);
}

// To where the trail leads out: what is remembered of somebody who has gone goes when it is looked
// at.
void Retrace::look_back(const BehaviorInput& input) {
  looking_since_ = input.now;
  if (!blocked_since_) blocked_since_ = input.now;
  awaiting_plan_ = false;  // what comes now was planned for another moment
  ++looks_;
  const Pose& X_WB = input.estimate->X_WB;
  looked_at_W_ = X_WB.p;
  vehicle::Command& station_here = station(X_WB);
  for (const Eigen::Vector3d& place_W : way_along_trail(X_WB.p).points) {
    const Eigen::Vector3d way = place_W - X_WB.p;
    if (way.head<2>().norm() < kLookedBack) continue;
    station_here.o = from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()));
    return;
  }
}

BehaviorOutput Retrace::wait(const BehaviorInput& input) {
  BehaviorOutput output;
  output.command = *station_;
  if (to_seconds(input.now - *blocked_since_) >= settings_.way_out_wait_s) {
    output.failed = Failure::kExhausted;
  } else if (to_seconds(input.now - *looking_since_) >= kLook) {
    looking_since_.reset();
    planning_ = false;
    tries_ = 0;
    begin(input);
  }
  return output;
}

BehaviorOutput Retrace::follow(const BehaviorInput& input) {
  BehaviorOutput output;
  output.command = follower_.step(input.estimate->X_WB, input.estimate->v_WB_B);
  progress_.distance_to_go_m = follower_.status().distance_to_go_m;
  progress_.cross_track_m = follower_.status().cross_track_m;
  progress_.segment = follower_.status().segment;
  if (!follower_.status().finished) return output;
  // There, if the vehicle comes to rest where it can go up; else on to where it can.
  begun_ = false;
  entered_at_ = input.now;
  station_.reset();
  const bool is_detour = is_patient() && !on_trail_;
  if (!is_detour && ++arrivals_ > kMaxArrivals) output.failed = Failure::kExhausted;
  return output;
}

void Retrace::take_answer(const BehaviorInput& input) {
  awaiting_plan_ = false;
  const PlanAnswer& plan = *input.plan;
  if (plan.status != planning::PlanStatus::kSuccess || plan.waypoints.size() < 2) {
    ++progress_.plan_failures;
    progress_.plan_failure = plan.reason;
    return;
  }
  on_trail_ = false;
  progress_.clearance_m = plan.clearance_m;
  planned_at_W_ = input.estimate->X_WB.p;
  ++planned_ways_;
  way_.assign(plan.waypoints.begin(), plan.waypoints.end());
  follower_.set_path(way_, input.estimate->X_WB.p);
  time_allowed_s_ = kGraceSeconds + kSlow * follower_.status().distance_to_go_m / settings_.speed;
  entered_at_ = input.now;
  planning_ = false;
}

// To the end of the trail; where only the trail is known, to the first place of it behind what
// blocks it, or a little along it where nothing does.
void Retrace::aim(const Eigen::Vector3d& p_W, LegSettings& settings, LegGoal& goal) const {
  goal.position_W = out_W_;
  if (!is_patient() || changes_ == nullptr) return;
  const std::vector<Pose> trail = level_poses(way_along_trail(p_W).points);
  const std::span<const Pose> near = beginning(trail, kAhead);
  std::size_t behind = beginning(trail, kPastNothing).size() - 1;
  for (std::size_t i = 1; i < near.size(); ++i) {
    if (changes_->clearance(near.subspan(i - 1, 2)) <= 0.0) behind = i + 1;
  }
  if (behind + 1 < trail.size()) goal.position_W = trail[behind].p;
  double highest = p_W.z();
  for (std::size_t i = 0; i <= behind && i < trail.size(); ++i) {
    highest = std::max(highest, trail[i].p.z());
  }
  settings.max_z = std::min(settings.max_z, highest + kRise);
}

BehaviorOutput Retrace::plan_out(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  BehaviorOutput output;
  output.command = station(X_WB);
  if (awaiting_plan_ && to_seconds(input.now - asked_at_) <= kPlanTimeout) return output;
  if (awaiting_plan_) progress_.plan_failure = "the planner does not answer";
  if (tries_ == static_cast<int>(kShares.size())) {
    look_back(input);
    return wait(input);
  }
  LegSettings settings = settings_;
  settings.clearance *= kShares[static_cast<std::size_t>(tries_)];
  settings.min_altitude = 0.0;
  settings.seed += static_cast<std::uint64_t>(tries_++);
  LegGoal goal;
  goal.id = progress_.leg;
  aim(X_WB.p, settings, goal);
  output.plan_request = leg_request(settings, goal, X_WB);
  output.plan_cause = why_;
  asked_at_ = input.now;
  awaiting_plan_ = true;
  return output;
}

}  // namespace dive::behaviors
