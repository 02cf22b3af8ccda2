#include "vehicle/follower.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/assert.h"
#include "common/range_check.h"

namespace dive::vehicle {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kVertical = 0.05;     // m: a segment horizontally shorter is vertical
constexpr double kSteep = 0.3;         // cosine of the slope that counts as vertical: 73 degrees
constexpr double kOverhead = 0.3;      // m beside a vertical segment within which steering is off
constexpr double kPastMinimum = 0.01;  // m of increase that confirm a minimum of the distance
constexpr double kCrabSpeed = 0.25;    // m/s: slower, the sideslip angle is the one at this speed
constexpr double kSmallError = 0.35;   // rad: heading error without slowdown: thrust turns
constexpr double kLargeError = 1.2;    // rad: heading error with the full turn_slowdown
constexpr double kDepthError = 0.15;   // m of depth error tolerated at full speed
constexpr double kCreep = 0.05;        // m/s: minimum speed for steering
constexpr double kSideways = 0.15;     // m/s: the same on its side, where only way holds the depth

double bearing_of(const Vector3d& direction) { return std::atan2(direction.y(), direction.x()); }

double slope_of(const Vector3d& direction) {
  return std::asin(std::clamp(direction.z(), -1.0, 1.0));
}

double yaw_of(const Pose& pose) { return to_rpy(pose.q).z(); }

}  // namespace

std::string FollowerOptions::validate() const {
  RangeCheck check;
  check("speed", speed, 0.05, 5.0);
  check("capture_radius", capture_radius, 0.01, 100.0);
  if (last_capture_radius) check("last_capture_radius", *last_capture_radius, 0.01, 100.0);
  check("lookahead_m", lookahead_m, 0.05, 100.0);
  check("turn_slowdown", turn_slowdown, 0.0, 1.0);
  check("corner_slowdown", corner_slowdown, 0.0, 1.0);
  check("arrival_speed", arrival_speed, 0.01, 5.0);
  check("braking_s", braking_s, 0.01, 60.0);
  check("heave_speed", heave_speed, 0.01, 5.0);
  check("depth_lead_m", depth_lead_m, 0.01, 10.0);
  return check.problem();
}

Follower::Follower(FollowerOptions options) : options_(options) {
  DIVE_DEMAND(options_.validate().empty());
}

Follower::Segment Follower::make_segment(const Pose& from, const Pose& to) {
  Segment result;
  result.start = from.p;
  const Vector3d motion = to.p - from.p;
  result.length = motion.norm();
  result.direction =
      result.length > 0.0 ? Vector3d(motion / result.length) : Vector3d(to.q * Vector3d::UnitX());
  result.bearing = motion.head<2>().norm() > kVertical ? bearing_of(motion) : yaw_of(to);
  return result;
}

void Follower::set_path(std::span<const Pose> waypoints, const Vector3d& position_W) {
  DIVE_DEMAND(waypoints.size() >= 2 && position_W.allFinite());
  waypoints_.assign(waypoints.begin(), waypoints.end());
  segments_.clear();
  status_ = {};
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < waypoints_.size(); ++i) {
    DIVE_DEMAND(waypoints_[i - 1].is_finite() && waypoints_[i].is_finite());
    const Segment& s = segments_.emplace_back(make_segment(waypoints_[i - 1], waypoints_[i]));
    const double along = std::clamp(s.direction.dot(position_W - s.start), 0.0, s.length);
    const double distance = (s.start + along * s.direction - position_W).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    status_.segment = static_cast<int>(i);
  }
  for (std::size_t i = segments_.size() - 1; i > 0; --i) {
    segments_[i - 1].remaining = segments_[i].remaining + segments_[i].length;
    segments_[i - 1].corner = std::abs(wrap_angle(segments_[i].bearing - segments_[i - 1].bearing));
  }
  nearest_m_ = std::numeric_limits<double>::infinity();
  observe(position_W);
}

const Follower::Segment& Follower::segment() const {
  return segments_[static_cast<std::size_t>(status_.segment - 1)];
}

double Follower::capture_radius() const {
  const bool last = static_cast<std::size_t>(status_.segment) == segments_.size();
  return last ? options_.last_capture_radius.value_or(options_.capture_radius)
              : options_.capture_radius;
}

void Follower::observe(const Vector3d& p_W) {
  const Segment& s = segment();
  const Vector3d from_start = p_W - s.start;
  status_.along_track_m = s.direction.dot(from_start);
  status_.cross_track_m = (from_start - status_.along_track_m * s.direction).norm();
  status_.distance_to_go_m =
      s.remaining + std::clamp(s.length - status_.along_track_m, 0.0, s.length);
}

bool Follower::passed(const Vector3d& p_W) {
  const double distance = (waypoints_[static_cast<std::size_t>(status_.segment)].p - p_W).norm();
  nearest_m_ = std::min(nearest_m_, distance);
  const bool reached = nearest_m_ < capture_radius() && distance > nearest_m_ + kPastMinimum;
  return reached || status_.along_track_m > segment().length;
}

void Follower::advance(const Vector3d& p_W) {
  observe(p_W);
  while (!status_.finished && passed(p_W)) {
    if (static_cast<std::size_t>(status_.segment) == segments_.size()) {
      status_.finished = true;
      status_.missed = nearest_m_ >= capture_radius();
      break;
    }
    ++status_.segment;
    nearest_m_ = std::numeric_limits<double>::infinity();
    observe(p_W);
  }
}

// Bearing from the vehicle to the point of the path that lies lookahead_m beyond its projection.
double Follower::course(const Vector3d& p_W) const {
  double left = options_.lookahead_m + std::max(status_.along_track_m, 0.0);
  auto index = static_cast<std::size_t>(status_.segment - 1);
  while (index + 1 < segments_.size() && left > segments_[index].length) {
    left -= segments_[index].length;
    ++index;
  }
  const Segment& s = segments_[index];
  const Vector3d carrot = s.start + left * s.direction;  // beyond the end: straight on
  const Vector2d motion = (carrot - p_W).head<2>();
  return motion.norm() > kOverhead ? std::atan2(motion.y(), motion.x()) : s.bearing;
}

double Follower::speed_towards(double against, double heading_error, double depth_error,
                               double left, double heave_share) const {
  const Segment& s = segment();
  const double to_end = std::max(s.length - status_.along_track_m, 0.0);
  const double sharpness = std::min(s.corner / (0.5 * M_PI), 1.0);
  const double corner = options_.speed * (1.0 - options_.corner_slowdown * sharpness);
  double speed = std::min(
      {options_.speed, against + corner + to_end / options_.braking_s,
       against + options_.arrival_speed + status_.distance_to_go_m / (2.0 * options_.braking_s)});
  const double off = (std::abs(heading_error) - kSmallError) / (kLargeError - kSmallError);
  speed *= 1.0 - options_.turn_slowdown * std::clamp(off, 0.0, 1.0);
  const double keeps_up = std::clamp(2.0 - std::abs(depth_error) / kDepthError, 0.0, 1.0);
  speed *= 1.0 - heave_share * (1.0 - keeps_up);
  speed = std::max(speed, kCreep + (1.0 - heave_share) * (kSideways - kCreep));

  return left < 0.5 * M_PI ? std::min(speed, options_.heave_speed / std::tan(std::max(left, 1e-3)))
                           : 0.0;
}

// Fraction of the segment whose depth is commanded now. Measured over ground: vertical progress
// grows only with the depth that it is to command, which on a vertical segment is the fixed point
// of the printed law again. On and near such a segment the commanded depth is a little ahead
// instead.
double Follower::depth_progress(const Vector3d& p_W) const {
  const Segment& s = segment();
  if (s.length <= 0.0) return 1.0;
  const Vector2d over_ground = s.direction.head<2>();
  if (over_ground.norm() < kSteep) {
    return (status_.along_track_m + options_.depth_lead_m) / s.length;
  }
  return over_ground.dot((p_W - s.start).head<2>()) / (over_ground.squaredNorm() * s.length);
}

Command Follower::step(const Pose& X_WB, const Vector3d& v_WB_B, const Vector2d& current_W) {
  DIVE_DEMAND(has_path() && X_WB.is_finite() && v_WB_B.allFinite() && current_W.allFinite());
  advance(X_WB.p);
  const Segment& s = segment();
  const auto index = static_cast<std::size_t>(status_.segment);
  const auto planned_at = [&](double share) {
    return interpolate(waypoints_[index - 1], waypoints_[index], std::clamp(share, 0.0, 1.0));
  };
  const Pose planned = planned_at(s.length > 0.0 ? status_.along_track_m / s.length : 1.0);
  const double z = planned_at(depth_progress(X_WB.p)).p.z();
  const Vector3d planned_rpy = to_rpy(planned.q);
  // Heave provides the climb that swimming along x does not: with the nose where it is, not where
  // it is planned, since a nose that is still low takes the vehicle ahead of its path.
  const double left = std::abs(slope_of(s.direction) - slope_of(X_WB.q * Vector3d::UnitX()));

  const double yaw = yaw_of(X_WB);
  const Vector3d v_L = from_rpy(0.0, 0.0, -yaw) * (X_WB.q * v_WB_B);
  const double sideslip = std::atan2(v_L.y(), std::max(v_L.x(), kCrabSpeed));
  const double heading = course(X_WB.p) - std::clamp(sideslip, -kMaxCrab, kMaxCrab);

  Command command;
  const double heave_share = std::abs((X_WB.q.conjugate() * Vector3d::UnitZ()).z());
  const double against = std::max(0.0, -s.direction.head<2>().dot(current_W));
  command.v = speed_towards(against, wrap_angle(heading - yaw), z - X_WB.p.z(), left, heave_share);
  command.d = -z;
  command.o = from_rpy(planned_rpy.x(), planned_rpy.y(), heading);
  return command;
}

void Follower::way_ahead(const Pose& X_WB, double max_m, std::vector<Pose>& way) const {
  DIVE_DEMAND(has_path());
  way.assign(1, X_WB);
  double left = max_m;
  const auto next = static_cast<std::size_t>(std::max(status_.segment, 1));
  for (const Pose& waypoint : path().subspan(next)) {
    const double length = (waypoint.p - way.back().p).norm();
    if (length >= left) {
      way.push_back(interpolate(way.back(), waypoint, left / length));
      break;
    }
    way.push_back(waypoint);
    left -= length;
  }
}

}  // namespace dive::vehicle
