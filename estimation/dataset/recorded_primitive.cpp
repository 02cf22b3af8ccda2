#include "estimation/dataset/recorded_primitive.h"

#include <algorithm>

namespace dive::estimation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kGravityRate = 0.05;  // 1/s, gain towards gravity of the integrated attitude
constexpr double kLongStep = 0.1;      // s between two IMU samples

std::optional<Quaterniond> attitude_of(const std::optional<TrueState>& truth) {
  if (!truth || !truth->has_attitude) return std::nullopt;
  return truth->X_WB.q;
}

}  // namespace

void PredictedAttitude::add_to(ImuSample& sample) {
  const Vector3d& up_B = sample.accel_B;
  if (!q_WB_) q_WB_ = Quaterniond::FromTwoVectors(up_B, Vector3d::UnitZ());
  if (last_) {
    const double dt = std::min(to_seconds(sample.utime - *last_), kLongStep);
    const Vector3d expected = q_WB_->conjugate() * Vector3d::UnitZ();
    const Vector3d pull = up_B.normalized().cross(expected);
    q_WB_ = (*q_WB_ * so3_exp(dt * (sample.gyro_B + kGravityRate * pull))).normalized();
  }
  last_ = sample.utime;
  sample.q_WB = *q_WB_;
}

RecordedPrimitive::RecordedPrimitive(const std::optional<TrueState>& truth, double speed)
    : attitude_(attitude_of(truth)),
      estimator_(PrimitiveOptions{}, start_position(truth).p_W, start_position(truth).sigma_m) {
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
