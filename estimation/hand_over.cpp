#include "estimation/hand_over.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "common/assert.h"
#include "common/range_check.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLeastPeriod = 0.005;  // s
constexpr double kMostPeriod = 2.0;     // s

Matrix2d turned(double yaw) { return Eigen::Rotation2Dd(yaw).toRotationMatrix(); }

Vector2d at_most(const Vector2d& v, double most) {
  const double norm = v.norm();
  return norm > most ? Vector2d(v * (most / norm)) : v;
}

double towards_zero(double value, double step) {
  return std::abs(value) <= step ? 0.0 : value - std::copysign(step, value);
}

// The turn about the vertical that takes attitude b to a.
double turn_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return to_rpy(a * b.conjugate()).z();
}

// Rows and columns x, y and heading of a covariance of position in W and attitude in B: the heading
// is the part of the rotation vector about the vertical u.
Matrix3d horizontal(const Matrix6d& P, const Vector3d& up_B) {
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  J(0, 0) = J(1, 1) = 1.0;
  J.block<1, 3>(2, 3) = up_B.transpose();
  return J * P * J.transpose();
}

bool is_sane(const StateEstimate& estimate) {
  return estimate.X_WB.is_finite() && std::abs(estimate.X_WB.q.norm() - 1.0) < 0.01 &&
         estimate.v_WB_B.allFinite() && estimate.covariance.allFinite();
}

}  // namespace

std::string HandOverOptions::validate() const {
  RangeCheck check;
  check("bad_words", bad_words, 1, 100);
  check("silent_periods", silent_periods, 1.0, 100.0);
  check("good_words", good_words, 1, 100);
  check("most_good_words", most_good_words, good_words, 1000);
  check("soon_s", soon_s, 0.0, 1000.0);
  check("max_age_s", max_age_s, 0.01, 4.0);
  check("approach", approach, 0.001, 10.0);
  check("approach_deg", approach_deg, 0.01, 90.0);
  check("drift_time_s", drift_time_s, 0.1, 1000.0);
  check("max_drift", max_drift, 0.0, 5.0);
  check("drift_memory_s", drift_memory_s, 1.0, 1e6);
  check("drift_sigma", drift_sigma, 0.0, 1.0);
  check("drift_share", drift_share, 0.0, 1.0);
  check("max_speed", max_speed, 0.1, 20.0);
  check("max_excess", max_excess, 0.01, 20.0);
  check("max_tilt_deg", max_tilt_deg, 1.0, 90.0);
  return check.problem();
}

HandOver::HandOver(const HandOverOptions& options, const PrimitiveOptions& primitive)
    : options_(options), primitive_(primitive), good_needed_(options.good_words) {
  DIVE_DEMAND(options_.validate().empty() && primitive_.validate().empty());
}

std::optional<HandOver::Past> HandOver::past_at(Utime utime) const {
  if (count_ == 0 || utime > newest().utime) return std::nullopt;
  const std::size_t oldest = count_ > kPast ? count_ - kPast : 0;
  std::size_t i = count_ - 1;
  while (i > oldest && past_[i % kPast].utime > utime) --i;
  const Past& before = past_[i % kPast];
  if (before.utime > utime) return std::nullopt;
  if (before.utime == utime || i + 1 == count_) return before;
  const Past& after = past_[(i + 1) % kPast];
  const double t = to_seconds(utime - before.utime) / to_seconds(after.utime - before.utime);
  Past between = before;
  between.utime = utime;
  between.p_W += t * (after.p_W - before.p_W);
  between.v_W += t * (after.v_W - before.v_W);
  between.q_WB = before.q_WB.slerp(t, after.q_WB);
  return between;
}

VisionFault HandOver::judge(Utime now, const VisionEstimate& vision) const {
  if (vision.fault != VisionFault::kNone) return vision.fault;
  const StateEstimate& estimate = vision.estimate;
  if (!estimate.valid) return VisionFault::kStarting;
  if (last_frame_ && vision.frame_utime <= *last_frame_) return VisionFault::kBadPicture;
  if (vision.frame_utime > now || estimate.utime > now) return VisionFault::kBadPicture;
  if (to_seconds(now - vision.frame_utime) > options_.max_age_s) return VisionFault::kLate;
  const std::optional<Past> at = past_at(estimate.utime);
  if (!at) return VisionFault::kLate;
  if (!is_sane(estimate)) return VisionFault::kImplausible;
  const Eigen::Quaterniond& q_WB = estimate.X_WB.q;
  const Vector3d up_B = q_WB.conjugate() * Vector3d::UnitZ();
  const Vector3d measured_up_B = at->q_WB.conjugate() * Vector3d::UnitZ();
  const double tilt = std::atan2(up_B.cross(measured_up_B).norm(), up_B.dot(measured_up_B));
  const Vector2d expected_W = turned(turn_between(q_WB, at->q_WB)) * at->v_W;
  const Vector2d excess_W = (q_WB * estimate.v_WB_B).head<2>() - expected_W;
  const Matrix3d P = horizontal(estimate.covariance, up_B);
  const bool is_plausible =
      estimate.v_WB_B.norm() <= options_.max_speed && excess_W.norm() <= options_.max_excess &&
      tilt <= deg_to_rad(options_.max_tilt_deg) && P.llt().info() == Eigen::Success;
  return is_plausible ? VisionFault::kNone : VisionFault::kImplausible;
}

void HandOver::add(Utime now, const VisionEstimate& vision) {
  if (vision.period_s >= kLeastPeriod && vision.period_s <= kMostPeriod) {
    period_s_ = vision.period_s;
  }
  if (begun_from_ != vision.begun_from) {
    begun_from_ = vision.begun_from;
    const std::optional<Past> then = past_at(vision.begun_from);
    begun_shift_W_ = then ? then->shift_W : shift_W_;
  }
  const VisionFault fault = judge(now, vision);
  if (fault != VisionFault::kNone) {
    good_ = 0;
    ++bad_;
    last_bad_ = fault;
    if (!has_vision()) fault_ = fault;
    if (has_vision() && bad_ >= options_.bad_words) give_up(fault);
    return;
  }
  bad_ = 0;
  ++good_;
  last_frame_ = vision.frame_utime;
  last_good_ = now;
  if (!has_vision() && good_ < good_needed_) return;
  if (!has_vision()) believed_since_ = now;
  believe(vision);
}

void HandOver::believe(const VisionEstimate& vision) {
  const StateEstimate& estimate = vision.estimate;
  const Past at = *past_at(estimate.utime);
  const Eigen::Quaterniond& q_WB = estimate.X_WB.q;
  const double since = std::min(to_seconds(at.utime - anchor_.utime), 2.0 * period_s_);
  anchor_ = at;
  yaw_target_ = turn_between(q_WB, at.q_WB);
  drift_W_ = (q_WB * estimate.v_WB_B).head<2>() - turned(yaw_target_) * at.v_W;
  averaged_s_ = std::min(averaged_s_ + since, options_.drift_time_s);
  if (averaged_s_ > 0.0) mean_drift_W_ += since / averaged_s_ * (drift_W_ - mean_drift_W_);
  base_W_ = estimate.X_WB.p.head<2>() + shift_W_ - begun_shift_W_ +
            drift_W_ * to_seconds(newest().utime - at.utime);
  offset_W_ = estimate_.X_WB.p.head<2>() - target();
  base_covariance_ = horizontal(estimate.covariance, q_WB.conjugate() * Vector3d::UnitZ());
  drift_doubt_ = 0.0;
  estimate_.source = EstimatorKind::kVisualInertial;
  has_begun_ = true;
  fault_ = VisionFault::kNone;
}

// From now on all stays as it is.
void HandOver::give_up(VisionFault fault) {
  base_covariance_ = uncertainty();
  anchor_ = newest();
  base_W_ = estimate_.X_WB.p.head<2>();
  offset_W_.setZero();
  yaw_target_ = yaw_;
  drift_doubt_ = (drift_W_ - mean_drift_W_).norm();
  drift_W_ = mean_drift_W_ = at_most(mean_drift_W_, options_.max_drift);
  const bool was_short =
      believed_since_ && to_seconds(newest().utime - *believed_since_) < options_.soon_s;
  good_needed_ =
      was_short ? std::min(2 * good_needed_, options_.most_good_words) : options_.good_words;
  good_ = 0;
  estimate_.source = EstimatorKind::kPrimitive;
  fault_ = fault;
}

void HandOver::moved(const Vector2d& by_W) {
  DIVE_DEMAND(by_W.allFinite());
  shift_W_ += by_W;
  base_W_ += by_W;
  estimate_.X_WB.p.head<2>() += by_W;
}

const StateEstimate& HandOver::update(const StateEstimate& primitive) {
  DIVE_DEMAND(count_ == 0 || primitive.utime >= newest().utime);
  if (!primitive.valid) return estimate_ = primitive;
  const double silence_s = to_seconds(primitive.utime - last_good_);
  if (has_vision() && silence_s > options_.silent_periods * period_s_) {
    give_up(bad_ > 0 ? last_bad_ : VisionFault::kNoPictures);
  }
  const double dt = count_ > 0 ? to_seconds(primitive.utime - newest().utime) : 0.0;
  const Vector3d v_W = primitive.X_WB.q * primitive.v_WB_B;
  past_[count_++ % kPast] = {primitive.utime, primitive.X_WB.p.head<2>(), v_W.head<2>(),
                             primitive.X_WB.q, shift_W_};
  advance(dt);
  publish(primitive);
  return estimate_;
}

void HandOver::advance(double dt) {
  base_W_ += drift_W_ * dt;
  if (!has_vision()) {
    drift_W_ *= std::exp(-dt / options_.drift_memory_s);
    return;
  }
  offset_W_ = at_most(offset_W_, std::max(offset_W_.norm() - options_.approach * dt, 0.0));
  const double left = wrap_angle(yaw_ - yaw_target_);
  yaw_ = wrap_angle(yaw_target_ + towards_zero(left, deg_to_rad(options_.approach_deg) * dt));
}

Vector2d HandOver::target() const { return base_W_ + turned(yaw_) * (newest().p_W - anchor_.p_W); }

void HandOver::publish(const StateEstimate& primitive) {
  const EstimatorKind source = estimate_.source;
  estimate_ = primitive;
  estimate_.source = source;
  if (!has_begun_) {
    estimate_.X_WB.p.head<2>() += shift_W_;
    return;
  }
  estimate_.X_WB.p.head<2>() = target() + offset_W_;
  estimate_.X_WB.q = (from_rpy(0.0, 0.0, yaw_) * primitive.X_WB.q).normalized();
  const Vector3d drift_W(drift_W_.x(), drift_W_.y(), 0.0);
  estimate_.v_WB_B += estimate_.X_WB.q.conjugate() * drift_W;

  const Matrix3d P = uncertainty();
  const Vector3d up_B = estimate_.X_WB.q.conjugate() * Vector3d::UnitZ();
  const double attitude_variance = std::pow(deg_to_rad(primitive_.attitude_sigma_deg), 2);
  Matrix6d& covariance = estimate_.covariance;
  covariance.setZero();
  covariance.topLeftCorner<2, 2>() = P.topLeftCorner<2, 2>();
  covariance(2, 2) = primitive.covariance(2, 2);
  covariance.bottomRightCorner<3, 3>() = P(2, 2) * up_B * up_B.transpose();
  covariance.diagonal().tail<3>().array() += attitude_variance;
  covariance.block<2, 3>(0, 3) = P.block<2, 1>(0, 2) * up_B.transpose();
  covariance.block<3, 2>(3, 0) = covariance.block<2, 3>(0, 3).transpose();
}

Matrix3d HandOver::uncertainty() const {
  if (!has_begun_) {
    const Vector3d up_B = estimate_.X_WB.q.conjugate() * Vector3d::UnitZ();
    return horizontal(estimate_.covariance, up_B);
  }
  const double t = to_seconds(newest().utime - anchor_.utime);
  const Vector2d D = turned(yaw_) * (newest().p_W - anchor_.p_W);
  Matrix3d F = Matrix3d::Identity();
  F.block<2, 1>(0, 2) = Vector2d(-D.y(), D.x());
  Matrix3d P = F * base_covariance_ * F.transpose();
  const double drift = options_.drift_sigma + options_.drift_share * drift_W_.norm() + drift_doubt_;
  const double walk = primitive_.drift_m_per_sqrt_s;
  P.topLeftCorner<2, 2>() += std::pow(primitive_.speed_scale_sigma, 2) * D * D.transpose();
  P.diagonal().head<2>().array() += std::pow(drift * t, 2) + walk * walk * t;
  P.topLeftCorner<2, 2>() += offset_W_ * offset_W_.transpose();
  P(2, 2) += std::pow(wrap_angle(yaw_ - yaw_target_), 2);
  return P;
}

}  // namespace dive::estimation
