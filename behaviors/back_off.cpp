#include "behaviors/back_off.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dive::behaviors {
namespace {

constexpr double kSpeed = 0.15;         // m/s, bow or stern first
constexpr double kLookahead = 0.4;      // m
constexpr double kArrived = 0.2;        // m
constexpr double kOffCourse = 0.5;      // rad of heading error above which it turns first
constexpr double kSmallRoll = 0.2;      // rad of roll: less is levelled
constexpr double kGraceSeconds = 15.0;  // s added to kSlow times the route's expected time
constexpr double kSlow = 3.0;

// A pose on the route: bow along `direction`, or opposite to it when astern.
Pose pose_at(const Eigen::Vector3d& p_W, const Eigen::Vector3d& direction, bool is_astern,
             double roll) {
  const Eigen::Vector3d bow = is_astern ? Eigen::Vector3d(-direction) : direction;
  return {p_W, from_rpy(roll, 0.0, std::atan2(bow.y(), bow.x()))};
}

}  // namespace

bool BackOff::is_needed(const BehaviorInput& input) {
  const Eigen::Vector3d& p_W = input.estimate->X_WB.p;
  if (last_W_) tight_m_ += (p_W - *last_W_).norm();
  last_W_ = p_W;
  if (!input.map_changed || input.observed == nullptr || input.trail == nullptr) return false;
  clearance_m_ = input.observed->clearance_to_all({&input.estimate->X_WB, 1});
  if (clearance_m_ >= planning::kMinStartClearance * d_min_m_) tight_m_ = 0.0;
  if (tried_at_ && to_seconds(input.now - *tried_at_) < options_.retry_s) return false;
  return clearance_m_ < options_.min_clearance * d_min_m_ || tight_m_ > planning::kMaxReducedLength;
}

Trail::Path BackOff::find_path(const BehaviorInput& input, const Criteria& criteria) const {
  const Pose& X_WB = input.estimate->X_WB;
  const double enough_gain_m = clearance_m_ + options_.min_gain_m;
  double most_m = enough_gain_m;
  Eigen::Vector3d clearest_W = X_WB.p;
  const auto will_do = [&](const Trail::Breadcrumb& breadcrumb) {
    const Eigen::Vector3d& p_W = breadcrumb.p_W;
    if ((p_W - X_WB.p).norm() < criteria.min_distance_m ||
        (criteria.needs_open_water && !breadcrumb.open_above))
      return false;
    const Pose there{p_W, X_WB.q};
    const double there_m = input.observed->clearance_to_all({&there, 1});
    if (there_m > most_m) {
      most_m = there_m;
      clearest_W = p_W;
    }
    return there_m >= planning::kMinStartClearance * d_min_m_ &&
           (criteria.min_distance_m > 0.0 || there_m > enough_gain_m);
  };
  const double link_m = kTrailLinkShare * d_min_m_;
  const double longest_m = criteria.max_distance_m.value_or(options_.max_distance_m);
  Trail::Path path = input.trail->path_to(X_WB.p, link_m, longest_m, will_do);
  if (path.arrives || clearest_W == X_WB.p) return path;
  return input.trail->path_to(X_WB.p, link_m, longest_m, [&](const Trail::Breadcrumb& breadcrumb) {
    return breadcrumb.p_W == clearest_W;
  });
}

int BackOff::count_at(const Eigen::Vector3d& p_W) const {
  const bool is_there = last_place_ && (p_W - last_place_->p_W).norm() <= options_.same_place_m;
  return is_there ? last_place_->count : 0;
}

bool BackOff::begin(const BehaviorInput& input, const Criteria& criteria) {
  tried_at_ = input.now;
  if (input.observed == nullptr || input.trail == nullptr) return false;
  Trail::Path path = find_path(input, criteria);
  if (!path.arrives) return false;
  const Pose& X_WB = input.estimate->X_WB;
  Route route;
  route.points_W = std::move(path.points);
  route.is_astern = (X_WB.q * Eigen::Vector3d::UnitX()).dot(route.points_W[1] - X_WB.p) < 0.0;
  route.until = input.now + from_seconds(kGraceSeconds + kSlow * path.length_m / kSpeed);
  if (const double roll = to_rpy(X_WB.q).x(); std::abs(roll) > kSmallRoll) route.roll = roll;
  // Often it is nowhere nearer than here: then a turn and the way back leave the same, and the way
  // back leads out.
  const double least_m = come_level_if_possible(route, input);
  if (least_m <= 0.0 || least_m < criteria.min_clearance_m) return false;
  route.least_m = options_.kept_clearance * least_m;
  route_ = std::move(route);
  last_place_ = Place{X_WB.p, count_at(X_WB.p) + 1};
  return true;
}

double BackOff::come_level_if_possible(Route& route, const BehaviorInput& input) const {
  const double roll = std::exchange(route.roll, 0.0);
  const double level_m = clearance_of_rest(route, input);
  if (roll == 0.0 || level_m >= options_.min_turn_clearance * d_min_m_) return level_m;
  route.roll = roll;
  const double rolled_m = clearance_of_rest(route, input);
  if (level_m < rolled_m) return rolled_m;
  route.roll = 0.0;
  return level_m;
}

// The rest of the route, with the turn on the spot at its start.
double BackOff::clearance_of_rest(const Route& route, const BehaviorInput& input) {
  std::vector<Pose> poses = {input.estimate->X_WB};
  Eigen::Vector3d from = poses.front().p;
  for (std::size_t i = route.next; i < route.points_W.size(); ++i) {
    poses.push_back(pose_at(from, route.points_W[i] - from, route.is_astern, route.roll));
    from = route.points_W[i];
  }
  poses.push_back({from, poses.back().q});
  return input.observed->clearance_to_all(poses);
}

std::optional<vehicle::Command> BackOff::follow(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  const std::vector<Eigen::Vector3d>& points_W = route_->points_W;
  std::size_t& next = route_->next;
  while (next + 1 < points_W.size() && (points_W[next] - X_WB.p).norm() < kLookahead) ++next;
  const Eigen::Vector3d direction = points_W[next] - X_WB.p;
  const bool has_arrived = next + 1 == points_W.size() && direction.norm() < kArrived;
  const bool is_blocked = route_->check.is_due(input) && input.observed != nullptr &&
                          come_level_if_possible(*route_, input) <= route_->least_m;
  if (has_arrived || is_blocked || input.now >= route_->until) {
    route_.reset();
    tight_m_ = 0.0;  // counted from here
    last_W_.reset();
    return std::nullopt;
  }
  vehicle::Command command;
  command.o = pose_at(X_WB.p, direction, route_->is_astern, route_->roll).q;
  command.d = std::max(-points_W[next].z(), 0.0);
  const double off = std::abs(wrap_angle(to_rpy(command.o).z() - to_rpy(X_WB.q).z()));
  const double speed = kSpeed * std::max(1.0 - off / kOffCourse, 0.0);
  command.v = route_->is_astern ? -speed : speed;
  return command;
}

}  // namespace dive::behaviors
