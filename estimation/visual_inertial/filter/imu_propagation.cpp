#include "estimation/visual_inertial/filter/imu_propagation.h"

#include <cmath>

#include "common/se3.h"

namespace dive::estimation {
namespace {

constexpr double kTurn_s =
    0.5;  // usual duration of a turn, in which an error of scale has one sign

}  // namespace

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d right_jacobian(const Vector3d& a) {
  const double square = a.squaredNorm();
  const double angle = std::sqrt(square);
  // By series where the quotients lose digits.
  const bool is_tiny = angle < 1e-3;
  const double b = is_tiny ? 0.5 - square / 24.0 : (1.0 - std::cos(angle)) / square;
  const double c =
      is_tiny ? 1.0 / 6.0 - square / 120.0 : (angle - std::sin(angle)) / (square * angle);
  const Matrix3d A = skew(a);
  return Matrix3d::Identity() - b * A + c * A * A;
}

ImuStep propagate(const ImuState& state, const Kinematics& first, const ImuInterval& interval,
                  const ImuNoise& noise, double gravity) {
  using namespace imu_error;
  const double dt = interval.dt;
  const Vector3d g(0.0, 0.0, -gravity);
  const Vector3d turn =
      (0.5 * (interval.begin.gyro_B + interval.end.gyro_B) - state.gyro_bias) * dt;
  const Vector3d a0 = interval.begin.accel_B - state.accel_bias;
  const Vector3d a1 = interval.end.accel_B - state.accel_bias;
  const Eigen::Quaterniond q_turn = so3_exp(turn);
  const Matrix3d D = q_turn.toRotationMatrix();
  const Matrix3d R = state.motion.q_WB.toRotationMatrix();

  ImuStep step;
  step.state = state;
  Kinematics& next = step.state.motion;
  next.q_WB = (state.motion.q_WB * q_turn).normalized();
  next.v_WB = state.motion.v_WB + g * dt + R * (0.5 * dt * (a0 + D * a1));
  next.p_WB = state.motion.p_WB + state.motion.v_WB * dt + 0.5 * dt * dt * g +
              R * (dt * dt / 6.0 * (2.0 * a0 + D * a1));

  const Matrix3d R_first = first.q_WB.toRotationMatrix();
  const Matrix3d R_next = next.q_WB.toRotationMatrix();
  const Matrix3d of_gyro = -right_jacobian(turn) * dt;           // effect on the rotation
  const Matrix3d of_bend = R_first * (D * -skew(a1) * of_gyro);  // effect on R D a1
  Matrix15d& F = step.transition;
  F.setIdentity();
  F.block<3, 3>(kAttitude, kAttitude) = R_next.transpose() * R_first;
  F.block<3, 3>(kAttitude, kGyroBias) = of_gyro;
  F.block<3, 3>(kVelocity, kAttitude) = -skew(next.v_WB - first.v_WB - g * dt) * R_first;
  F.block<3, 3>(kVelocity, kGyroBias) = 0.5 * dt * of_bend;
  F.block<3, 3>(kVelocity, kAccelBias) = -0.5 * dt * R_first * (Matrix3d::Identity() + D);
  F.block<3, 3>(kPosition, kAttitude) =
      -skew(next.p_WB - first.p_WB - first.v_WB * dt - 0.5 * dt * dt * g) * R_first;
  F.block<3, 3>(kPosition, kVelocity) = dt * Matrix3d::Identity();
  F.block<3, 3>(kPosition, kGyroBias) = dt * dt / 6.0 * of_bend;
  F.block<3, 3>(kPosition, kAccelBias) =
      -dt * dt / 6.0 * R_first * (2.0 * Matrix3d::Identity() + D);

  // A reading's noise acts like an error of the bias; over dt its variance is density^2 / dt.
  const auto by_gyro = F.block<9, 3>(0, kGyroBias);
  const auto by_accel = F.block<9, 3>(0, kAccelBias);
  const double rate = turn.norm() / dt;
  const double gyro = noise.gyro * noise.gyro + interval.gyro * interval.gyro +
                      kTurn_s * std::pow(noise.scale * rate, 2);
  const double accel = noise.accel * noise.accel + interval.accel * interval.accel;
  step.noise.setZero();
  step.noise.topLeftCorner<9, 9>() =
      gyro / dt * by_gyro * by_gyro.transpose() + accel / dt * by_accel * by_accel.transpose();
  // Gravity turns in B, and with it what it contributes by scale and g-sensitivity to the biases.
  const double gyro_walk = std::hypot(noise.gyro_walk, noise.gyro_by_accel * gravity * rate);
  const double accel_walk = std::hypot(noise.accel_walk, noise.scale * gravity * rate);
  step.noise.diagonal().segment<3>(kGyroBias).setConstant(gyro_walk * gyro_walk * dt);
  step.noise.diagonal().segment<3>(kAccelBias).setConstant(accel_walk * accel_walk * dt);
  return step;
}

ImuStep propagate_over(const ImuState& begin, const Kinematics& first,
                       const std::vector<ImuInterval>& intervals, const ImuNoise& noise,
                       double gravity) {
  ImuStep sum{begin, Matrix15d::Identity(), Matrix15d::Zero()};
  Kinematics from = first;
  for (const ImuInterval& interval : intervals) {
    const ImuStep step = propagate(sum.state, from, interval, noise, gravity);
    sum.transition = step.transition * sum.transition;
    sum.noise = step.transition * sum.noise * step.transition.transpose() + step.noise;
    sum.state = step.state;
    from = step.state.motion;
  }
  return sum;
}

}  // namespace dive::estimation
