#include "estimation/primitive.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/planar.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMaxStep = 0.05;          // s: longer intervals are divided into such steps
constexpr double kMaxExtrapolation = 0.5;  // s, maximum use of a turn rate after its sample
constexpr double kDepthSilence = 0.5;      // s, after which the height is dead-reckoned
constexpr double kHeaveSigma = 0.05;       // m/s, one sigma
constexpr double kBlindDrift = 0.02;       // m/s, one sigma, per axis
constexpr double kBlindTurn = 0.1;         // rad/s, one sigma
constexpr double kAnyDirection = 1.8;      // rad, one sigma: any direction is equally likely
constexpr double kGyroBias_s = 10.0;       // s over which the bias of the turn rate is averaged
constexpr double kAttitudeJump = 3.0;      // rad/s: the attitude was corrected, and did not turn
constexpr double kMinSigma = 1e-3;         // m: lower bound of the initial position sigma

}  // namespace

std::string PrimitiveOptions::validate() const {
  RangeCheck check;
  check("speed_scale_sigma", speed_scale_sigma, 0.0, 1.0);
  check("heading_bias_sigma_deg", heading_bias_sigma_deg, 0.0, 90.0);
  check("attitude_sigma_deg", attitude_sigma_deg, 0.001, 90.0);
  check("depth_sigma_m", depth_sigma_m, 1e-4, 10.0);
  check("depth_bias_sigma_m", depth_bias_sigma_m, 0.0, 10.0);
  check("vertical_acceleration", vertical_acceleration, 1e-4, 10.0);
  check("drift_m_per_sqrt_s", drift_m_per_sqrt_s, 0.0, 1.0);
  check("current_sigma", current_sigma, 0.0, 5.0);
  return check.problem().empty() ? motion.validate() : check.problem();
}

PrimitiveEstimator::PrimitiveEstimator(const PrimitiveOptions& options, const Vector3d& position_W,
                                       double position_sigma_m)
    : options_(options),
      motion_(options.motion),
      depth_(options.depth_sigma_m, options.vertical_acceleration, position_W.z()),
      start_variance_(std::pow(std::max(position_sigma_m, kMinSigma), 2)) {
  DIVE_DEMAND(options_.validate().empty());
  DIVE_DEMAND(position_W.allFinite() && position_sigma_m >= 0.0);
  estimate_.X_WB.p = position_W;
}

void PrimitiveEstimator::set_commanded_speed(double speed) {
  DIVE_DEMAND(std::isfinite(speed));
  propulsion_ = {.speed = speed};
}

void PrimitiveEstimator::set_efforts(double surge, double heave) {
  DIVE_DEMAND(std::isfinite(surge) && std::isfinite(heave));
  propulsion_ = {.efforts = Vector2d(surge, heave).cwiseMax(-1.0).cwiseMin(1.0)};
}

void PrimitiveEstimator::set_expected_heave(double heave) {
  DIVE_DEMAND(std::isfinite(heave));
  expected_heave_ = heave;
}

void PrimitiveEstimator::set_current(const Vector2d& current_W) {
  DIVE_DEMAND(current_W.allFinite());
  current_W_ = current_W;
}

void PrimitiveEstimator::dead_reckon(const Vector2d& by_W, double sigma_m, double surge) {
  DIVE_DEMAND(by_W.allFinite() && sigma_m >= 0.0 && std::isfinite(surge));
  motion_.begin_at(surge);
  estimate_.X_WB.p.head<2>() += by_W;
  start_variance_ += sigma_m * sigma_m;
  if (estimate_.valid) fill_covariance();
}

void PrimitiveEstimator::set_velocity(const Vector3d& v_B) {
  DIVE_DEMAND(v_B.allFinite());
  motion_.set_velocity(v_B);
}

void PrimitiveEstimator::add(const ImuSample& sample) {
  const double norm = sample.q_WB.norm();
  if (!(std::abs(norm - 1.0) < 0.01) || !sample.gyro_B.allFinite()) return;
  if (imu_ && sample.utime <= measured_) return;
  const std::optional<ImuSample> before = is_blind_ ? std::nullopt : imu_;
  imu_ = sample;
  measured_ = sample.utime;
  imu_->q_WB.normalize();
  if (before) observe_gyro_bias(*before);
  is_blind_ = false;
}

// Attitudes are noisy, but not biased like turn rates: over many samples they show the bias.
void PrimitiveEstimator::observe_gyro_bias(const ImuSample& before) {
  const double dt = to_seconds(imu_->utime - before.utime);
  if (dt > kMaxExtrapolation) return;
  const Vector3d turned = so3_log(before.q_WB.conjugate() * imu_->q_WB) / dt;
  const Vector3d off = 0.5 * (before.gyro_B + imu_->gyro_B) - turned;
  if (off.cwiseAbs().maxCoeff() > kAttitudeJump) return;
  gyro_bias_B_ += -std::expm1(-dt / kGyroBias_s) * (off - gyro_bias_B_);
}

void PrimitiveEstimator::predict_attitude(Utime utime, const Eigen::Quaterniond& q_WB,
                                          const Vector3d& omega_B) {
  DIVE_DEMAND(q_WB.coeffs().allFinite() && omega_B.allFinite());
  if (!imu_ || utime <= imu_->utime) return;
  imu_->utime = utime;
  imu_->q_WB = q_WB.normalized();
  imu_->gyro_B = omega_B;
  is_blind_ = true;
}

void PrimitiveEstimator::add(const DepthSample& sample) {
  if (std::isfinite(sample.depth_m)) depth_.add(sample.utime, -sample.depth_m);
}

const StateEstimate& PrimitiveEstimator::update(Utime now) {
  DIVE_DEMAND(now >= estimate_.utime);
  if (!imu_ || !depth_.started()) {
    estimate_.utime = now;
    return estimate_;
  }
  const double dt = estimate_.valid ? to_seconds(now - estimate_.utime) : 0.0;
  estimate_.utime = now;
  estimate_.valid = true;
  estimate_.X_WB.q = attitude(now);
  estimate_.omega_WB_B = imu_->gyro_B;
  grow_blind(dt);
  const bool depth_is_fresh = to_seconds(now - depth_.last()) <= kDepthSilence;
  silence_s_ = depth_is_fresh ? 0.0 : silence_s_ + dt;
  if (depth_is_fresh) estimate_.X_WB.p.z() = depth_.at(now).z;
  for (double left = dt; left > 0.0; left -= kMaxStep) propagate(std::min(left, kMaxStep));
  estimate_.v_WB_B = velocity_B() + estimate_.X_WB.q.conjugate() * lifted(current_W_);
  fill_covariance();
  return estimate_;
}

// An unobserved drift: it has the direction of an attitude that is not measured either.
void PrimitiveEstimator::grow_blind(double dt) {
  blind_s_ = is_blind_ ? blind_s_ + dt : 0.0;
  start_variance_ += 2.0 * kBlindDrift * kBlindDrift * blind_s_ * dt;
}

// The last attitude, propagated at its own rate over the sensor's latency.
Eigen::Quaterniond PrimitiveEstimator::attitude(Utime now) const {
  const double age = std::clamp(to_seconds(now - imu_->utime), 0.0, kMaxExtrapolation);
  return (imu_->q_WB * so3_exp(age * imu_->gyro_B)).normalized();
}

void PrimitiveEstimator::propagate(double dt) {
  const Vector3d up_B = estimate_.X_WB.q.conjugate() * Vector3d::UnitZ();
  motion_.advance(propulsion_, imu_->gyro_B - gyro_bias_B_, up_B, dt);
  if (silence_s_ == 0.0) motion_.correct(depth_.at(estimate_.utime).rate, up_B, dt);
  const Vector3d step = (estimate_.X_WB.q * velocity_B()) * dt;
  displacement_W_ += step.head<2>();
  excess_W_ += excess_velocity_W() * dt;
  estimate_.X_WB.p.head<2>() += step.head<2>() + current_W_ * dt;
  if (silence_s_ > 0.0) estimate_.X_WB.p.z() = std::min(estimate_.X_WB.p.z() + step.z(), 0.0);
  elapsed_s_ += dt;
}

// Through the water. Without depth samples the steady heave that the efforts should give.
Vector3d PrimitiveEstimator::velocity_B() const {
  Vector3d v_B = motion_.v_B();
  if (silence_s_ > 0.0) v_B.z() = expected_heave_;
  return v_B;
}

Vector2d PrimitiveEstimator::excess_velocity_W() const {
  return (estimate_.X_WB.q * (motion_.by_scale_B() - motion_.v_B())).head<2>();
}

OdometryErrors PrimitiveEstimator::errors() const {
  return {start_variance_, excess_velocity_W(), excess_W_};
}

void PrimitiveEstimator::fill_covariance() {
  const double attitude_variance = std::pow(deg_to_rad(options_.attitude_sigma_deg), 2) +
                                   std::pow(std::min(kBlindTurn * blind_s_, kAnyDirection), 2);
  const double drift_variance = options_.drift_m_per_sqrt_s * options_.drift_m_per_sqrt_s;
  Matrix6d& P = estimate_.covariance;
  P.setZero();
  P.diagonal().head<2>().setConstant(start_variance_ + drift_variance * elapsed_s_ +
                                     std::pow(options_.current_sigma * elapsed_s_, 2));
  P(2, 2) = silence_s_ > 0.0
                ? std::pow(kHeaveSigma * silence_s_, 2)
                : depth_.at(estimate_.utime).variance + std::pow(options_.depth_bias_sigma_m, 2);
  P.diagonal().tail<3>().setConstant(attitude_variance);

  // One column per constant error: the effect of one sigma of it on [position; attitude].
  Vector6d speed_scale = Vector6d::Zero();
  speed_scale.head<2>() = options_.speed_scale_sigma * displacement_W_;
  Vector6d heading_bias = Vector6d::Zero();
  heading_bias.head<2>() = Vector2d(-displacement_W_.y(), displacement_W_.x());
  heading_bias.tail<3>() = estimate_.X_WB.q.conjugate() * Vector3d::UnitZ();
  heading_bias *= deg_to_rad(options_.heading_bias_sigma_deg);
  P += speed_scale * speed_scale.transpose() + heading_bias * heading_bias.transpose();
}

}  // namespace dive::estimation
