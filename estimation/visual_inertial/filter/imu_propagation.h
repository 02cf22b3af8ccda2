#pragma once
// One step of the IMU, from one reading to the next, with its Jacobian in closed form. The rate is
// the mean of the two readings, the specific force linear between them. With D = Exp(w dt), a0 and
// a1 the two specific forces and g gravity:
//
//   w = (I + T_g) (gyro - b_g),   a = (I + T_a) (accel - b_a)
//   R' = R D,   v' = v + g dt + R dt/2 (a0 + D a1),
//   p' = p + v dt + g dt^2/2 + R dt^2/6 (2 a0 + D a1)
//
// Errors: R_true = R Exp(theta), the rest additive. The factors of theta are written with the
// states themselves (Li and Mourikis 2013, "High-precision, consistent EKF-based visual-inertial
// odometry", IJRR 32(6), eq. 24), so that a rotation about the vertical and a translation stay
// unobservable. doc/visual-inertial/propagation.md derives it.

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "estimation/visual_inertial/filter/filter_options.h"

namespace dive::estimation {

using Matrix15d = Eigen::Matrix<double, 15, 15>;
using Matrix3x9d = Eigen::Matrix<double, 3, 9>;

/// First indices of the parts of the IMU's error.
namespace imu_error {
inline constexpr int kAttitude = 0;
inline constexpr int kPosition = 3;
inline constexpr int kVelocity = 6;
inline constexpr int kGyroBias = 9;
inline constexpr int kAccelBias = 12;
inline constexpr int kSize = 15;
}  // namespace imu_error

struct Kinematics {
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();  ///< In W, m/s.
};

/// Errors of scale and of the axes' directions, T_g and T_a.
struct ImuIntrinsics {
  static constexpr int kSize = 18;  ///< Errors: the elements of T_g, then of T_a, column by column.

  Eigen::Matrix3d gyro = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d accel = Eigen::Matrix3d::Zero();
};

struct ImuState {
  Kinematics motion;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  ///< m/s^2
  ImuIntrinsics intrinsics = {};
};

struct ImuReading {
  Eigen::Vector3d gyro_B = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Vector3d accel_B = Eigen::Vector3d::Zero();  ///< m/s^2
};

/// The interval from one reading to the next.
struct ImuInterval {
  ImuReading begin;
  ImuReading end;
  double dt = 0.0;     ///< s, > 0
  double gyro = 0.0;   ///< Extra density for gaps and saturation.
  double accel = 0.0;  ///< Extra density for gaps and saturation.
};

struct ImuStep {
  ImuState state;
  Matrix15d transition;
  Matrix15d noise;
  /// Effect of errors of the intrinsics on attitude, position and velocity.
  Eigen::Matrix<double, 9, ImuIntrinsics::kSize> by_intrinsics;
};

[[nodiscard]] ImuStep propagate(const ImuState& state, const ImuInterval& interval,
                                const ImuNoise& noise, double gravity);

/// The same over successive intervals.
[[nodiscard]] ImuStep propagate_over(const ImuState& begin,
                                     const std::vector<ImuInterval>& intervals,
                                     const ImuNoise& noise, double gravity);

/// T v = of_elements(v) t, with t the elements of a 3 x 3 matrix T, column by column.
[[nodiscard]] Matrix3x9d of_elements(const Eigen::Vector3d& v);

/// Right Jacobian of SO(3): Exp(a + b) = Exp(a) Exp(J b) to first order (Sola et al., eq. 143).
[[nodiscard]] Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& a);

}  // namespace dive::estimation
