#include "mission/executive/exit_path_keeper.h"

#include <algorithm>
#include <cmath>

#include "mission/executive/overhead_monitor.h"
#include "vehicle/ascent_rates.h"
#include "vehicle/going_home.h"
#include "vehicle/speed_range.h"

namespace dive::mission {
namespace {

using behaviors::Rung;
using Eigen::Vector3d;

constexpr std::size_t kOpenPoints = 3;   // in open water, about 1 m beyond the edge
constexpr double kBeyond = 2.0;          // m beyond the edge
constexpr std::size_t kCapacity = 1024;  // points
constexpr double kStraight = 0.1;        // m: points nearer to a segment are left out
constexpr std::size_t kWindow = 20;      // maximum points of a segment
constexpr double kMaxRoom = 3.0;         // m

double distance_to_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

// Of points with a member p_W.
bool is_straight(const auto& points) {
  return std::ranges::all_of(points, [&](const auto& point) {
    return distance_to_segment(point.p_W, points.front().p_W, points.back().p_W) <= kStraight;
  });
}

double length(const auto& points) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    length_m += (points[i].p_W - points[i - 1].p_W).norm();
  }
  return length_m;
}

double ascent_s(const Vector3d& p_W) { return std::max(-p_W.z(), 0.0) / vehicle::kMeanAscentRate; }

}  // namespace

ExitPathKeeper::ExitPathKeeper(const ExitPathOptions& options, MapView& map)
    : options_(options), map_(map) {
  points_.reserve(kCapacity);
  path_.waypoints.reserve(vehicle::kMaxExitWaypoints);
  path_.speed = std::max(options.speed, vehicle::kMinSpeed);
}

void ExitPathKeeper::restore(std::span<const behaviors::Trail::Breadcrumb> trail) {
  for (const behaviors::Trail::Breadcrumb& breadcrumb : trail) {
    add({breadcrumb.p_W, breadcrumb.utime}, breadcrumb.open_above);
  }
}

void ExitPathKeeper::move(const MapCorrection& correction) {
  for (Point& point : points_) point.p_W = correction.at(point.utime) * point.p_W;
  if (!path_.waypoints.empty()) write_waypoints();
}

void ExitPathKeeper::update(const Situation& situation, const Vector3d& v_B,
                            const estimation::UnmodelledMotion& unmodelled, Rung rung) {
  const estimation::StateEstimate& estimate = situation.estimate;
  path_.utime = situation.now;
  path_.X_WB = estimate.X_WB;
  path_.position_sigma_m = estimation::horizontal_sigma(estimate);
  path_.v_B = v_B;
  path_.heading_correction = estimate.map_from_odom.yaw;
  path_.speed_scale = unmodelled.speed_scale;
  path_.current_W = unmodelled.current_W;
  path_.open_above = situation.open_above;
  add({estimate.X_WB.p, situation.now}, situation.open_above);
  path_.hold_s = hold_s(situation, rung);
}

// Without position feedback a held vehicle drifts: where it has no room, within the distance from
// the trail in which the water is free.
double ExitPathKeeper::hold_s(const Situation& situation, Rung rung) const {
  if (situation.is_terminated || rung >= Rung::kEmergencySurface) return 0.0;
  if (rung >= Rung::kRetrace) return kMinHold;
  if (situation.open_above && from_room_ && points_.size() == 1) return kHoldInOpenWater;
  const double left = std::clamp(1.0 - situation.budget_used, 0.0, 1.0);
  const double most = situation.open_above ? kHoldInOpenWater : left * kMaxHold;
  return std::max(kMinHold, std::min(most, options_.link_m / drift_speed()));
}

// Two sigmas, or more where a current is measured.
double ExitPathKeeper::drift_speed() const {
  return std::max(2.0 * std::hypot(options_.current_sigma, vehicle::kStopSigma),
                  path_.current_W.norm());
}

bool ExitPathKeeper::has_room(const Vector3d& p_W) const {
  return !map_.overhead(p_W, std::min(kAscentDrift + drift_speed() * ascent_s(p_W), kMaxRoom));
}

// Worth the way: half the time of an ascent.
bool ExitPathKeeper::is_room_near(const Vector3d& p_W) const {
  return from_room_ && length(points_) <= 0.5 * ascent_s(p_W) * path_.speed;
}

void ExitPathKeeper::add(const Point& point, bool open_above) {
  const bool was_open = open_ == points_.size();
  const bool is_near =
      !points_.empty() && (point.p_W - points_.back().p_W).norm() < behaviors::kTrailSpacing;
  if (is_near && open_above == was_open) return;
  if (open_above) {
    if (!was_open && !from_room_) leave_overhead(point.p_W);
    return add_open(point);
  }
  add_point(point);
  write_waypoints();
}

// With room only this point is kept; without, the way from the last place with room while it is
// near, or else the last points.
void ExitPathKeeper::add_open(const Point& point) {
  if (has_room(point.p_W)) {
    points_.clear();
    from_room_ = true;
  }
  add_point(point);
  const bool is_near = is_room_near(point.p_W);
  if (from_room_ && !is_near) points_.assign(1, point);
  from_room_ = is_near;
  if (!from_room_ && points_.size() > kOpenPoints) points_.erase(points_.begin());
  open_ = points_.size();
  if (from_room_ && points_.size() > 1) {
    write_waypoints();
  } else {
    clear_waypoints();
  }
}

// A loop of the trail is cut out.
void ExitPathKeeper::add_point(const Point& point) {
  const auto link = std::ranges::find_if(points_, [&](const Point& earlier) {
    return (earlier.p_W - point.p_W).norm() <= options_.link_m;
  });
  if (link != points_.end()) points_.erase(link + 1, points_.end());
  open_ = std::min(open_, points_.size());
  if (points_.size() == kCapacity) thin_out();
  points_.push_back(point);
}

// Where it came in the way out leads farther into open water than to the edge that it has reached.
void ExitPathKeeper::leave_overhead(const Vector3d& p_W) {
  points_.resize(open_);
  std::erase_if(points_, [&](const Point& point) { return (point.p_W - p_W).norm() > kBeyond; });
}

void ExitPathKeeper::clear_waypoints() {
  if (path_.waypoints.empty()) return;
  path_.waypoints.clear();
  ++path_.revision;
}

void ExitPathKeeper::thin_out() {
  std::size_t kept = open_;
  for (std::size_t i = open_; i < points_.size(); i += 2) points_[kept++] = points_[i];
  points_.resize(kept);
}

// From the newest point to the oldest in open water; straight stretches become one segment.
void ExitPathKeeper::write_waypoints() {
  std::vector<Pose>& waypoints = path_.waypoints;
  waypoints.clear();
  ++path_.revision;
  if (open_ == 0) return;
  std::size_t from = points_.size() - 1;
  while (waypoints.size() < vehicle::kMaxExitWaypoints) {
    waypoints.push_back(Pose{points_[from].p_W, Eigen::Quaterniond::Identity()});
    if (from == 0) break;
    std::size_t to = from - 1;
    while (to > 0 && from - to < kWindow &&
           is_straight(std::span(points_).subspan(to - 1, from - to + 2))) {
      --to;
    }
    from = to;
  }
  if (from != 0) {  // longer than a packet holds
    waypoints.clear();
    return;
  }
  for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
    const Vector3d ahead = waypoints[i + 1].p - waypoints[i].p;
    waypoints[i].q = from_rpy(0.0, 0.0, std::atan2(ahead.y(), ahead.x()));
  }
  if (waypoints.size() > 1) waypoints.back().q = waypoints[waypoints.size() - 2].q;
}

}  // namespace dive::mission
