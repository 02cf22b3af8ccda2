#include "estimation/frame_correction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/planar.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d at_most(const Vector2d& v, double most) {
  const double norm = v.norm();
  return norm > most ? Vector2d(v * (most / norm)) : v;
}

// A shift leaves the attitude as it is, bit for bit.
Pose moved(const PlanarTransform& by, const Pose& pose) {
  return by.yaw == 0.0 ? Pose{pose.p + lifted(by.translation), pose.q} : by * pose;
}

// Of x, y and heading.
Matrix3d turned_covariance(const Matrix3d& P, double yaw) {
  Matrix3d R = Matrix3d::Identity();
  R.topLeftCorner<2, 2>() = turned(yaw);
  return R * P * R.transpose();
}

double towards_zero(double value, double step) {
  return std::abs(value) <= step ? 0.0 : value - std::copysign(step, value);
}

}  // namespace

std::string FrameCorrectionOptions::validate() const {
  if (std::string problem = gate.validate(); !problem.empty()) return problem;
  RangeCheck check;
  check("approach", approach, 0.001, 10.0);
  check("approach_deg", approach_deg, 0.01, 90.0);
  check("drift_time_s", drift_time_s, 0.1, 1000.0);
  check("max_drift", max_drift, 0.0, 5.0);
  check("drift_memory_s", drift_memory_s, 1.0, 1e6);
  check("drift_sigma", drift_sigma, 0.0, 1.0);
  check("drift_share", drift_share, 0.0, 1.0);
  check("slip_time_s", slip_time_s, 0.1, 1000.0);
  check("max_slip", max_slip, 0.0, 5.0);
  check("max_smooth_m", max_smooth_m, 0.0, 10.0);
  check("jump_m", jump_m, 0.0, 10.0);
  check("vision_period_s", vision_period_s, 0.0, 100.0);
  check("vision_sigma", vision_sigma, 0.001, 1.0);
  check("scan_period_s", scan_period_s, 0.1, 5.0);
  return check.problem().empty() && fixes ? fixes->validate() : check.problem();
}

FrameCorrection::FrameCorrection(const FrameCorrectionOptions& options,
                                 const PrimitiveOptions& odometry)
    : options_(options), odometry_(odometry), gate_(options.gate) {
  DIVE_DEMAND(options_.validate().empty() && odometry_.validate().empty());
  if (options_.fixes) filter_.emplace(*options_.fixes);
}

std::optional<OdometryState> FrameCorrection::odometry_at(Utime utime) const {
  const auto around = past_.at(utime);
  if (!around) return std::nullopt;
  const OdometryState& before = around->before->odometry;
  const OdometryState& after = around->after->odometry;
  if (around->share == 0.0) return before;
  const auto between = [&](Vector2d OdometryState::*of) -> Vector2d {
    return before.*of + around->share * (after.*of - before.*of);
  };
  return OdometryState{between(&OdometryState::p_O), between(&OdometryState::v_O),
                       before.q_OB.slerp(around->share, after.q_OB),
                       between(&OdometryState::excess_velocity_O),
                       between(&OdometryState::excess_O)};
}

void FrameCorrection::propose(Utime now, const VisionEstimate& vision) {
  if (init_utime_ != vision.init_utime) {
    init_utime_ = vision.init_utime;
    const auto then = past_.at(vision.init_utime);
    aligned_at_init_ = then ? then->before->aligned : aligned_;
  }
  const std::optional<OdometryState> then = odometry_at(vision.estimate.utime);
  switch (gate_.evaluate(now, vision, then)) {
    case VisionGate::Decision::kAccepted:
      return follow(vision.estimate, *then);
    case VisionGate::Decision::kLost:
      return release();
    case VisionGate::Decision::kRejected:
      return;
  }
}

// Neighbouring images share their errors, so that not every one counts.
void FrameCorrection::follow_velocity(const StateEstimate& vision, const OdometryState& then) {
  estimate_.source = EstimatorKind::kVisualInertial;
  if (seen_ && to_seconds(vision.utime - *seen_) < options_.vision_period_s) return;
  seen_ = vision.utime;
  const Vector2d velocity = (vision.X_WB.q * vision.v_WB_B).head<2>();
  const double to_map = filter_->heading_correction() - turn_between(vision.X_WB.q, then.q_OB);
  const double information = 1.0 / (options_.vision_sigma * options_.vision_sigma);
  // One that is refused is a glitch of the cameras: the next one is half a second away.
  static_cast<void>(filter_->apply_velocity(turned(to_map) * velocity,
                                            information * Matrix2d::Identity(), then.v_O,
                                            then.excess_velocity_O));
}

void FrameCorrection::follow_surroundings(const MapFix& fix, const OdometryState& then) {
  if (fix.information.isZero()) return ambiguous_.reset();
  // The heading is as uncertain as it is believed.
  const double heading = fix.information(2, 2) + 1.0 / filter_->covariance()(2, 2);
  const Vector2d cross = fix.information.block<2, 1>(0, 2);
  Ambiguous now;
  now.utime = fix.scan_utime;
  now.p_O = then.p_O;
  now.excess_O = then.excess_O;
  now.information = fix.information.topLeftCorner<2, 2>() - cross * cross.transpose() / heading;
  const Vector2d gradient = fix.gradient.head<2>() - cross * (fix.gradient[2] / heading);
  // Where the scan does not constrain the position it stays; one sigma of a metre.
  const Matrix2d with_prior = now.information + Matrix2d::Identity();
  now.position_W = fix.position_W + with_prior.ldlt().solve(gradient);
  const std::optional<Ambiguous> last = std::exchange(ambiguous_, now);
  const double dt = last ? to_seconds(now.utime - last->utime) : 0.0;
  if (dt <= 0.0 || dt > options_.scan_period_s) return;
  // (A^-1 + B^-1)^-1 = A - A (A + B)^-1 A
  const Matrix2d sum = now.information + last->information + Matrix2d::Identity();
  const Matrix2d both = last->information - last->information * sum.inverse() * last->information;
  // One that is refused is that of another place.
  static_cast<void>(filter_->apply_velocity(
      (now.position_W - last->position_W) / dt, 0.5 * dt * dt * (both + both.transpose()),
      (now.p_O - last->p_O) / dt, (now.excess_O - last->excess_O) / dt));
}

void FrameCorrection::follow(const StateEstimate& vision, const OdometryState& then) {
  if (filter_) return follow_velocity(vision, then);
  const PlanarTransform map_from_vision = aligned_ * aligned_at_init_.inverse();
  const Pose X_WB = moved(map_from_vision, vision.X_WB);
  const Eigen::Quaterniond& q_WB = X_WB.q;
  const double since_s = std::min(to_seconds(vision.utime - anchor_utime_), 2.0 * gate_.period_s());
  anchor_utime_ = vision.utime;
  anchor_O_ = then.p_O;
  yaw_target_ = turn_between(q_WB, then.q_OB);
  drift_W_ = (q_WB * vision.v_WB_B).head<2>() - turned(yaw_target_) * then.v_O;
  averaged_s_ = std::min(averaged_s_ + since_s, options_.drift_time_s);
  if (averaged_s_ > 0.0) mean_drift_W_ += since_s / averaged_s_ * (drift_W_ - mean_drift_W_);
  base_W_ = X_WB.p.head<2>() + drift_W_ * to_seconds(past_.newest_utime() - vision.utime);
  offset_W_ = estimate_.X_WB.p.head<2>() - target();
  base_covariance_ = turned_covariance(
      horizontal_covariance(vision.covariance, q_WB.conjugate() * Vector3d::UnitZ()),
      map_from_vision.yaw);
  drift_deviation_ = 0.0;
  estimate_.source = EstimatorKind::kVisualInertial;
  follows_vision_ = true;
}

// Loss of vision: the correction keeps the published value.
void FrameCorrection::release() {
  estimate_.source = EstimatorKind::kPrimitive;
  if (filter_) return;
  base_covariance_ = uncertainty();
  anchor_utime_ = past_.newest_utime();
  anchor_O_ = past_.newest().odometry.p_O;
  base_W_ = estimate_.X_WB.p.head<2>();
  offset_W_.setZero();
  yaw_target_ = yaw_;
  drift_deviation_ = (drift_W_ - mean_drift_W_).norm();
  drift_W_ = mean_drift_W_ = at_most(mean_drift_W_, options_.max_drift);
}

void FrameCorrection::propose_alignment(const Vector2d& by_W) {
  DIVE_DEMAND(by_W.allFinite());
  shift({0.0, by_W});
  slip_W_ = at_most(slip_W_ + by_W / options_.slip_time_s, options_.max_slip);
}

void FrameCorrection::move(const PlanarTransform& by) {
  DIVE_DEMAND(!filter_ && std::isfinite(by.yaw) && by.translation.allFinite());
  const Vector3d before_W = estimate_.X_WB.p;
  shift(by);
  jumps_ |= (estimate_.X_WB.p - before_W).norm() > options_.jump_m;
  const Matrix2d R = turned(by.yaw);
  drift_W_ = R * drift_W_;
  mean_drift_W_ = R * mean_drift_W_;
  offset_W_ = R * offset_W_;
  slip_W_ = R * slip_W_;
  yaw_ = wrap_angle(yaw_ + by.yaw);
  yaw_target_ = wrap_angle(yaw_target_ + by.yaw);
  base_covariance_ = turned_covariance(base_covariance_, by.yaw);
}

void FrameCorrection::shift(const PlanarTransform& by) {
  aligned_ = by * aligned_;
  base_W_ = turned(by.yaw) * base_W_ + by.translation;
  estimate_.X_WB = moved(by, estimate_.X_WB);
  estimate_.map_from_odom = by * estimate_.map_from_odom;
}

bool FrameCorrection::propose(const MapFix& fix) {
  DIVE_DEMAND(filter_.has_value());
  const std::optional<OdometryState> then = odometry_at(fix.scan_utime);
  if (!then) return false;
  if (fix.problem == MapFixProblem::kAmbiguous) {
    follow_surroundings(fix, *then);
    return false;
  }
  ambiguous_.reset();
  if (fix.problem != MapFixProblem::kNone) return false;
  const OdometryState& now = past_.newest().odometry;
  const Vector2d moved_W = filter_->apply(fix, now.p_O - then->p_O, now.excess_O - then->excess_O);
  yaw_target_ = filter_->heading_correction();
  if (moved_W.norm() > options_.max_smooth_m) {
    offset_W_.setZero();
    jumps_ = true;
  } else {
    offset_W_ -= moved_W;
  }
  return true;
}

void FrameCorrection::set_current(const Vector2d& current_W) {
  DIVE_DEMAND(current_W.allFinite());
  declared_W_ = current_W;
  if (filter_) filter_->set_current(current_W);
}

const StateEstimate& FrameCorrection::update(const StateEstimate& odometry,
                                             const OdometryErrors& errors) {
  DIVE_DEMAND(past_.empty() || odometry.utime >= past_.newest_utime());
  if (!odometry.valid) return estimate_ = odometry;
  has_jumped_ = std::exchange(jumps_, false);
  if (gate_.times_out(odometry.utime)) release();
  const double dt = past_.empty() ? 0.0 : to_seconds(odometry.utime - past_.newest_utime());
  const Vector3d v_O = odometry.X_WB.q * odometry.v_WB_B;
  if (filter_ && past_.empty()) {
    filter_->begin(odometry.X_WB.p.head<2>(), odometry.covariance(0, 0));
    blind_variance_ = errors.blind_variance;
  }
  const OdometryState now{odometry.X_WB.p.head<2>(), v_O.head<2>(), odometry.X_WB.q,
                          errors.excess_velocity_W, errors.excess_W};
  const OdometryState before = past_.empty() ? now : past_.newest().odometry;
  past_.push(odometry.utime, {now, aligned_});
  advance(now.p_O - before.p_O, now.excess_O - before.excess_O, errors.blind_variance, dt);
  publish(odometry);
  return estimate_;
}

void FrameCorrection::advance(const Vector2d& moved_O, const Vector2d& excess_O,
                              double blind_variance, double dt) {
  if (filter_) {
    filter_->advance(moved_O, excess_O, dt, std::max(blind_variance - blind_variance_, 0.0));
    blind_variance_ = blind_variance;
  }
  base_W_ += drift_W_ * dt;
  slip_W_ *= std::exp(-dt / options_.slip_time_s);
  if (!filter_ && !gate_.uses_vision()) {
    drift_W_ *= std::exp(-dt / options_.drift_memory_s);
    return;
  }
  offset_W_ = at_most(offset_W_, std::max(offset_W_.norm() - options_.approach * dt, 0.0));
  const double left = wrap_angle(yaw_ - yaw_target_);
  yaw_ = wrap_angle(yaw_target_ + towards_zero(left, deg_to_rad(options_.approach_deg) * dt));
}

/// Displacement of the odometry since t_f, in W.
Vector2d FrameCorrection::displacement() const {
  return turned(yaw_) * (past_.newest().odometry.p_O - anchor_O_);
}

/// The published position without o.
Vector2d FrameCorrection::target() const {
  return filter_ ? filter_->position_W() : Vector2d(base_W_ + displacement());
}

void FrameCorrection::publish(const StateEstimate& odometry) {
  const EstimatorKind source = estimate_.source;
  estimate_ = odometry;
  estimate_.source = source;
  if (follows_vision_ || filter_) {
    publish_corrected(odometry);
  } else {
    publish_aligned();
  }
}

void FrameCorrection::publish_aligned() {
  estimate_.map_from_odom = aligned_;
  estimate_.X_WB = moved(aligned_, estimate_.X_WB);
  estimate_.v_WB_B += estimate_.X_WB.q.conjugate() * lifted(slip_W_);
}

void FrameCorrection::publish_corrected(const StateEstimate& odometry) {
  estimate_.X_WB.p.head<2>() = target() + offset_W_;
  estimate_.X_WB.q = (from_rpy(0.0, 0.0, yaw_) * odometry.X_WB.q).normalized();
  estimate_.map_from_odom.yaw = yaw_;
  estimate_.map_from_odom.translation =
      estimate_.X_WB.p.head<2>() - turned(yaw_) * odometry.X_WB.p.head<2>();
  estimate_.v_WB_B += estimate_.X_WB.q.conjugate() * lifted(unmodelled_velocity_W());

  const Matrix3d P = uncertainty();
  const Vector3d up_B = estimate_.X_WB.q.conjugate() * Vector3d::UnitZ();
  // That of the odometry grows while the attitude is predicted; its least axis has no heading bias.
  const double attitude_variance = filter_ ? odometry.covariance.diagonal().tail<3>().minCoeff()
                                           : std::pow(deg_to_rad(odometry_.attitude_sigma_deg), 2);
  Matrix6d& covariance = estimate_.covariance;
  covariance.setZero();
  covariance.topLeftCorner<2, 2>() = P.topLeftCorner<2, 2>();
  covariance(2, 2) = odometry.covariance(2, 2);
  covariance.bottomRightCorner<3, 3>() = P(2, 2) * up_B * up_B.transpose();
  covariance.diagonal().tail<3>().array() += attitude_variance;
  covariance.block<2, 3>(0, 3) = P.block<2, 1>(0, 2) * up_B.transpose();
  covariance.block<3, 2>(3, 0) = covariance.block<2, 3>(0, 3).transpose();
}

Vector2d FrameCorrection::unmodelled_velocity_W() const {
  if (!filter_) return drift_W_;
  const OdometryState& now = past_.newest().odometry;
  const Vector2d by_scale_O = now.v_O - declared_W_ + now.excess_velocity_O;
  return filter_->drift_W() + filter_->speed_scale() * (turned(yaw_) * by_scale_O);
}

std::optional<Eigen::Matrix2d> FrameCorrection::covariance_among_obstacles() const {
  if (!filter_) return std::nullopt;
  return filter_->covariance_among_obstacles() + offset_W_ * offset_W_.transpose();
}

UnmodelledMotion FrameCorrection::unmodelled() const {
  if (filter_) return {filter_->speed_scale(), filter_->current_W(), filter_->slip_W()};
  return {0.0, declared_W_ + drift_W_, Vector2d::Zero()};
}

/// Covariance of x, y and heading of the published pose.
Matrix3d FrameCorrection::uncertainty() const {
  if (filter_) {
    Matrix3d P = filter_->covariance();
    P.topLeftCorner<2, 2>() += offset_W_ * offset_W_.transpose();
    P(2, 2) += std::pow(wrap_angle(yaw_ - yaw_target_), 2);
    return P;
  }
  if (!follows_vision_) {
    return horizontal_covariance(estimate_.covariance,
                                 estimate_.X_WB.q.conjugate() * Vector3d::UnitZ());
  }
  const double t = to_seconds(past_.newest_utime() - anchor_utime_);
  const Vector2d D = displacement();
  Matrix3d F = Matrix3d::Identity();
  F.block<2, 1>(0, 2) = Vector2d(-D.y(), D.x());
  Matrix3d P = F * base_covariance_ * F.transpose();
  const double drift =
      options_.drift_sigma + options_.drift_share * drift_W_.norm() + drift_deviation_;
  const double walk = odometry_.drift_m_per_sqrt_s;
  P.topLeftCorner<2, 2>() += std::pow(odometry_.speed_scale_sigma, 2) * D * D.transpose();
  P.diagonal().head<2>().array() += std::pow(drift * t, 2) + walk * walk * t;
  P.topLeftCorner<2, 2>() += offset_W_ * offset_W_.transpose();
  P(2, 2) += std::pow(wrap_angle(yaw_ - yaw_target_), 2);
  return P;
}

}  // namespace dive::estimation
