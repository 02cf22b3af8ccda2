#include "estimation/dataset/recorded_primitive.h"

#include <algorithm>

namespace dive::estimation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Gain towards gravity of the integrated attitude, 1/s: 4 / t within these, and of the bias 6 /
// t^2, which fit an attitude and a constant bias to all samples since the start by least squares.
constexpr double kLeastGain = 0.05;
constexpr double kMostGain = 2.0;
constexpr double kLongStep = 0.1;  // s between two IMU samples
// Of the attitude, while the vehicle accelerates by a few percent of gravity.
constexpr double kAttitudeSigma_deg = 2.0;

std::optional<Quaterniond> attitude_of(const std::optional<TrueState>& truth) {
  if (!truth || !truth->has_attitude) return std::nullopt;
  return truth->X_WB.q;
}

Vector3d gyro_bias_of(const std::optional<TrueState>& truth) {
  return truth && truth->bias ? truth->bias->gyro : Vector3d::Zero();
}

PrimitiveOptions options_without_ahrs() {
  PrimitiveOptions options;
  options.attitude_sigma_deg = kAttitudeSigma_deg;
  return options;
}

}  // namespace

void PredictedAttitude::add_to(ImuSample& sample) {
  const Vector3d& up_B = sample.accel_B;
  if (!q_WB_) q_WB_ = Quaterniond::FromTwoVectors(up_B, Vector3d::UnitZ());
  if (last_) {
    const double dt = std::min(to_seconds(sample.utime - *last_), kLongStep);
    const Vector3d expected = q_WB_->conjugate() * Vector3d::UnitZ();
    const Vector3d pull = up_B.normalized().cross(expected);
    const double age = std::max(to_seconds(sample.utime - *first_), dt);
    const double gain = std::clamp(4.0 / age, kLeastGain, kMostGain);
    bias_B_ -= 6.0 / 16.0 * gain * gain * dt * pull;
    q_WB_ = (*q_WB_ * so3_exp(dt * (sample.gyro_B - bias_B_ + gain * pull))).normalized();
  } else {
    first_ = sample.utime;
  }
  last_ = sample.utime;
  sample.q_WB = *q_WB_;
}

RecordedPrimitive::RecordedPrimitive(const std::optional<TrueState>& truth, double speed)
    : attitude_(attitude_of(truth), gyro_bias_of(truth)),
      estimator_(options_without_ahrs(), start_position(truth).p_W, start_position(truth).sigma_m) {
  estimator_.set_commanded_speed(speed);
}

const StateEstimate& RecordedPrimitive::step(const VisionInput& input) {
  auto depth = input.depth.begin();
  auto velocity = input.velocity.begin();
  for (ImuSample sample : input.imu) {
    for (; depth != input.depth.end() && depth->utime <= sample.utime; ++depth) {
      estimator_.add(*depth);
    }
    for (; velocity != input.velocity.end() && velocity->utime <= sample.utime; ++velocity) {
      estimator_.set_commanded_speed(velocity->v_B.x());
      estimator_.set_velocity(velocity->v_B);
    }
    attitude_.add_to(sample);
    estimator_.add(sample);
  }
  for (; depth != input.depth.end(); ++depth) estimator_.add(*depth);
  updated_ = std::max(updated_, input.now);
  return estimator_.update(updated_);
}

}  // namespace dive::estimation
