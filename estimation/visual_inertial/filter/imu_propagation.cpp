#include "estimation/visual_inertial/filter/imu_propagation.h"

#include <cmath>

#include "common/se3.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A reading's noise acts like an error of the bias; over dt its variance is density^2 / dt. `rate`
// in rad/s.
Matrix15d process_noise(const Matrix15d& F, double rate, const ImuInterval& interval,
                        const ImuNoise& noise, double gravity) {
  using namespace imu_error;
  const double dt = interval.dt;
  const auto by_gyro = F.block<9, 3>(0, kGyroBias);
  const auto by_accel = F.block<9, 3>(0, kAccelBias);
  const double gyro = noise.gyro * noise.gyro + interval.gyro * interval.gyro;
  const double accel = noise.accel * noise.accel + interval.accel * interval.accel;
  Matrix15d Q = Matrix15d::Zero();
  Q.topLeftCorner<9, 9>() =
      gyro / dt * by_gyro * by_gyro.transpose() + accel / dt * by_accel * by_accel.transpose();
  // Gravity turns in B, and with it what it adds to the gyro's bias by g-sensitivity.
  const double gyro_walk = std::hypot(noise.gyro_walk, noise.gyro_by_accel * gravity * rate);
  Q.diagonal().segment<3>(kGyroBias).setConstant(gyro_walk * gyro_walk * dt);
  Q.diagonal().segment<3>(kAccelBias).setConstant(noise.accel_walk * noise.accel_walk * dt);
  return Q;
}

}  // namespace

Matrix3x9d of_elements(const Vector3d& v) {
  Matrix3x9d J;
  J << v.x() * Matrix3d::Identity(), v.y() * Matrix3d::Identity(), v.z() * Matrix3d::Identity();
  return J;
}

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

ImuStep propagate(const ImuState& state, const ImuInterval& interval, const ImuNoise& noise,
                  double gravity) {
  using namespace imu_error;
  const double dt = interval.dt;
  const Vector3d g(0.0, 0.0, -gravity);
  const Matrix3d gyro_scale = Matrix3d::Identity() + state.intrinsics.gyro;
  const Matrix3d accel_scale = Matrix3d::Identity() + state.intrinsics.accel;
  const Vector3d raw_rate = 0.5 * (interval.begin.gyro_B + interval.end.gyro_B) - state.gyro_bias;
  const Vector3d raw0 = interval.begin.accel_B - state.accel_bias;
  const Vector3d raw1 = interval.end.accel_B - state.accel_bias;
  const Vector3d turn = gyro_scale * raw_rate * dt;
  const Vector3d a0 = accel_scale * raw0;
  const Vector3d a1 = accel_scale * raw1;
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

  const Matrix3d R_next = next.q_WB.toRotationMatrix();
  const Matrix3d of_rate = right_jacobian(turn) * dt;      // effect on the rotation
  const Matrix3d of_bend = R * (D * -skew(a1) * of_rate);  // effect on R D a1
  Eigen::Matrix<double, 9, 3> by_rate;
  by_rate << of_rate, dt * dt / 6.0 * of_bend, 0.5 * dt * of_bend;
  Matrix15d& F = step.transition;
  F.setIdentity();
  F.block<3, 3>(kAttitude, kAttitude) = R_next.transpose() * R;
  F.block<9, 3>(0, kGyroBias) = -by_rate * gyro_scale;
  F.block<3, 3>(kVelocity, kAttitude) = -skew(next.v_WB - state.motion.v_WB - g * dt) * R;
  F.block<3, 3>(kVelocity, kAccelBias) = -0.5 * dt * R * (Matrix3d::Identity() + D) * accel_scale;
  F.block<3, 3>(kPosition, kAttitude) =
      -skew(next.p_WB - state.motion.p_WB - state.motion.v_WB * dt - 0.5 * dt * dt * g) * R;
  F.block<3, 3>(kPosition, kVelocity) = dt * Matrix3d::Identity();
  F.block<3, 3>(kPosition, kAccelBias) =
      -dt * dt / 6.0 * R * (2.0 * Matrix3d::Identity() + D) * accel_scale;

  const Matrix3x9d by_T0 = R * of_elements(raw0);
  const Matrix3x9d by_T1 = R * D * of_elements(raw1);
  step.by_intrinsics.leftCols<9>() = by_rate * of_elements(raw_rate);
  step.by_intrinsics.rightCols<9>() << Matrix3x9d::Zero(), dt * dt / 6.0 * (2.0 * by_T0 + by_T1),
      0.5 * dt * (by_T0 + by_T1);

  step.noise = process_noise(F, turn.norm() / dt, interval, noise, gravity);
  return step;
}

ImuStep propagate_over(const ImuState& begin, const std::vector<ImuInterval>& intervals,
                       const ImuNoise& noise, double gravity) {
  ImuStep sum;
  sum.state = begin;
  sum.transition.setIdentity();
  sum.noise.setZero();
  sum.by_intrinsics.setZero();
  for (const ImuInterval& interval : intervals) {
    const ImuStep step = propagate(sum.state, interval, noise, gravity);
    sum.by_intrinsics =
        step.transition.topLeftCorner<9, 9>() * sum.by_intrinsics + step.by_intrinsics;
    sum.transition = step.transition * sum.transition;
    sum.noise = step.transition * sum.noise * step.transition.transpose() + step.noise;
    sum.state = step.state;
  }
  return sum;
}

}  // namespace dive::estimation
