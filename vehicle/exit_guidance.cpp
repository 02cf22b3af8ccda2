#include "vehicle/exit_guidance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimation/planar.h"
#include "vehicle/ascent_rates.h"
#include "vehicle/going_home.h"
#include "vehicle/speed_range.h"

namespace dive::vehicle {
namespace {

constexpr double kDisplaced = 0.25;     // m from the place known to have open water above
constexpr double kSlow = 3.0;           // allowed time over expected time, and
constexpr double kGraceSeconds = 30.0;  // s added to it
constexpr double kSensorWait = 2.0;     // s for attitude and depth to arrive
constexpr double kMaxCoordinate = 1e6;  // m, of a plausible coordinate
constexpr double kMaxVelocity = 5.0;    // m/s
constexpr double kMaxScale = 0.5;       // of a plausible relative error of the speed
constexpr double kMaxTurn = 7.0;        // rad
constexpr double kMaxHold = 600.0;      // s
constexpr double kDepthFresh = 1.0;     // s

FollowerOptions follower_options(double speed) {
  FollowerOptions options;
  options.speed = std::clamp(speed, kMinSpeed, kMaxSpeed);
  options.capture_radius = kHomeCaptureRadius;
  return options;
}

}  // namespace

const char* to_string(ExitPhase phase) {
  switch (phase) {
    case ExitPhase::kIdle:
      return "watching";
    case ExitPhase::kHolding:
      return "holding";
    case ExitPhase::kFollowing:
      return "following the exit path";
    case ExitPhase::kAscending:
      return "ascending";
  }
  return "watching";
}

ExitGuidance::ExitGuidance(const MotionModel& motion,
                           std::optional<estimation::MapFixOptions> fixes)
    : motion_(motion),
      odometry_({.motion = motion}, Eigen::Vector3d::Zero(), 0.0),
      fixes_(fixes),
      follower_(follower_options(kMinSpeed)) {}

bool ExitGuidance::is_plausible(const ExitPath& path) {
  const auto is_place = [](const Pose& pose) {
    return pose.is_finite() && pose.p.cwiseAbs().maxCoeff() <= kMaxCoordinate;
  };
  return is_place(path.X_WB) && path.position_sigma_m >= 0.0 &&
         path.position_sigma_m <= kMaxCoordinate && path.v_B.norm() <= kMaxVelocity &&
         std::abs(path.heading_correction) <= kMaxTurn && std::abs(path.speed_scale) <= kMaxScale &&
         path.current_W.norm() <= kMaxVelocity && std::abs(path.hold_s) <= kMaxHold &&
         std::isfinite(path.speed) && path.waypoints.size() <= kMaxExitWaypoints &&
         std::ranges::all_of(path.waypoints, is_place);
}

bool ExitGuidance::set_exit_path(const ExitPath& path) {
  if (phase_ == ExitPhase::kFollowing || phase_ == ExitPhase::kAscending) return false;
  if (!is_plausible(path)) return false;
  path_ = path;
  heading_correction_ = path.heading_correction;
  odometry_.set_velocity(path.v_B / (1.0 + path.speed_scale));  // dead_reckon() scales it again
  reckoned_W_ = estimate_.X_WB.p.head<2>() = path.X_WB.p.head<2>();
  if (phase_ != ExitPhase::kIdle) begin_correction();
  return true;
}

void ExitGuidance::observe(const std::optional<ImuSample>& imu,
                           const std::optional<DepthSample>& depth, const PseudoRates& efforts,
                           Utime now) {
  now_ = std::max(now_, now);
  if (imu) {
    ImuSample turned = *imu;
    turned.utime = now_;
    turned.q_WB = from_rpy(0.0, 0.0, heading_correction_) * imu->q_WB;
    odometry_.add(turned);
  }
  if (depth && std::isfinite(depth->depth_m)) {
    depth_ = depth->depth_m;
    depth_at_ = now_;
    odometry_.add(DepthSample{now_, depth->depth_m});
    const bool is_up = depth->depth_m < kSurfaceDepth;
    if (!is_up) at_surface_since_.reset();
    if (is_up && !at_surface_since_) at_surface_since_ = now_;
  }
  odometry_.set_efforts(efforts.surge, efforts.heave);
  dead_reckon(odometry_.update(now_));
}

void ExitGuidance::dead_reckon(const estimation::StateEstimate& odometry) {
  const Eigen::Vector2d current_W = path_ ? path_->current_W : Eigen::Vector2d::Zero();
  const double scale = path_ ? path_->speed_scale : 0.0;
  const estimation::OdometryErrors errors = odometry_.errors();
  if (last_odometry_) {
    const Eigen::Vector2d moved_W = (odometry.X_WB.p - last_odometry_->X_WB.p).head<2>();
    reckoned_W_ += moved_W + scale * (moved_W + errors.excess_W - last_excess_W_) +
                   current_W * to_seconds(odometry.utime - last_odometry_->utime);
  }
  last_odometry_ = odometry;
  last_excess_W_ = errors.excess_W;
  estimation::StateEstimate reckoned = odometry;
  reckoned.X_WB.p.head<2>() = reckoned_W_;
  const double sigma_m = path_ ? path_->position_sigma_m : 0.0;
  reckoned.covariance.topLeftCorner<2, 2>() = sigma_m * sigma_m * Eigen::Matrix2d::Identity();
  reckoned.v_WB_B = odometry.v_WB_B + scale * odometry_.by_scale_B() +
                    odometry.X_WB.q.conjugate() * estimation::lifted(current_W);
  estimate_ = correction_ ? correction_->update(reckoned, errors) : reckoned;
}

void ExitGuidance::begin_correction() {
  correction_.reset();
  if (!fixes_ || !path_) return;
  estimation::FrameCorrectionOptions options;
  options.fixes = fixes_;
  options.fixes->start_sigma_m = 0.0;  // that of the exit path counts
  correction_.emplace(options, estimation::PrimitiveOptions{.motion = motion_});
  correction_->set_current(path_->current_W);
}

bool ExitGuidance::propose(const MapFix& fix) { return correction_ && correction_->propose(fix); }

void ExitGuidance::begin(Utime now, bool may_hold) {
  now_ = since_ = std::max(now_, now);
  phase_ = ExitPhase::kHolding;
  allowed_s_ = may_hold ? hold_s() : 0.0;
  begin_correction();
  keep_station();
  ascended_blindly_ = false;
}

void ExitGuidance::keep_station() {
  const double z = path_ ? path_->X_WB.p.z() : estimate_.X_WB.p.z();
  station_depth_ = depth_ ? *depth_ : std::max(-z, 0.0);
  station_yaw_ = to_rpy(estimate_.X_WB.q).z();
}

double ExitGuidance::hold_s() const {
  const bool knows = path_ && (path_->open_above || !path_->waypoints.empty());
  return knows ? path_->hold_s : kUnknownHold;
}

Command ExitGuidance::hold() const {
  Command command;
  command.d = station_depth_;
  command.o = from_rpy(0.0, 0.0, station_yaw_);
  return command;
}

Command ExitGuidance::step(Utime now) {
  now_ = std::max(now_, now);
  const bool is_late = to_seconds(now_ - since_) >= allowed_s_;
  const bool is_located = estimate_.valid || to_seconds(now_ - since_) > allowed_s_ + kSensorWait;
  if (phase_ == ExitPhase::kHolding && is_late && is_located) leave(now_);
  if (phase_ == ExitPhase::kFollowing) {
    command_ = follower_.step(estimate_.X_WB, estimate_.v_WB_B,
                              path_ ? path_->current_W : Eigen::Vector2d::Zero());
    if (follower_.status().finished || to_seconds(now_ - since_) > allowed_s_) {
      ascend(now_, !follower_.status().finished);
    }
  }
  if (phase_ == ExitPhase::kHolding) command_ = hold();
  if (phase_ == ExitPhase::kAscending) {
    command_ = hold();
    command_.d = 0.0;
  }
  Command compass = command_;
  compass.o = from_rpy(0.0, 0.0, -heading_correction_ - estimate_.map_from_odom.yaw) * command_.o;
  return compass;
}

// Open water is at the end of the exit path, or above where the executive measured it; otherwise
// straight up is all that is left.
void ExitGuidance::leave(Utime now) {
  if (!path_ || !estimate_.valid) return ascend(now, true);
  const Pose here{estimate_.X_WB.p, from_rpy(0.0, 0.0, station_yaw_)};
  if (!path_->waypoints.empty()) {
    std::vector<Pose> path = {here};
    path.insert(path.end(), path_->waypoints.begin(), path_->waypoints.end());
    return follow(std::move(path), now);
  }
  if (!path_->open_above) return ascend(now, true);
  if ((here.p - path_->X_WB.p).head<2>().norm() < kDisplaced) return ascend(now, false);
  const Eigen::Vector3d back(path_->X_WB.p.x(), path_->X_WB.p.y(), here.p.z());
  follow({here, Pose{back, here.q}}, now);
}

void ExitGuidance::follow(std::vector<Pose> path, Utime now) {
  follower_ = Follower(follower_options(path_->speed));
  follower_.set_path(path, path.front().p);
  phase_ = ExitPhase::kFollowing;
  since_ = now;
  allowed_s_ =
      kGraceSeconds + kSlow * path_length(path) / std::clamp(path_->speed, kMinSpeed, kMaxSpeed);
}

void ExitGuidance::ascend(Utime now, bool blindly) {
  phase_ = ExitPhase::kAscending;
  since_ = now;
  ascended_blindly_ = blindly;
  keep_station();
}

bool ExitGuidance::depth_is_fresh(Utime now) const {
  return depth_ && to_seconds(now - depth_at_) <= kDepthFresh;
}

bool ExitGuidance::has_surfaced(Utime now) const {
  return depth_is_fresh(now) && at_surface_since_ &&
         to_seconds(now - *at_surface_since_) > kSurfaceTime;
}

bool ExitGuidance::is_presumed_surfaced(Utime now) const {
  return phase_ == ExitPhase::kAscending && !depth_is_fresh(now) &&
         to_seconds(now - since_) > blind_ascent_s(station_depth_, kSlowestAscentRate);
}

}  // namespace dive::vehicle
