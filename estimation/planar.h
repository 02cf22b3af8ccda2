#pragma once
// The components of an attitude and of a covariance about the vertical.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/se3.h"

namespace dive::estimation {

/// Rotation about the vertical (rad) that takes attitude b to attitude a.
[[nodiscard]] inline double turn_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return to_rpy(a * b.conjugate()).z();
}

/// Turns horizontal vectors by `yaw` (rad).
[[nodiscard]] inline Eigen::Matrix2d turned(double yaw) {
  return Eigen::Rotation2Dd(yaw).toRotationMatrix();
}

/// A horizontal vector in three dimensions.
[[nodiscard]] inline Eigen::Vector3d lifted(const Eigen::Vector2d& v) {
  return {v.x(), v.y(), 0.0};
}

/// Covariance of x, y and heading from that of position in W and attitude in B. The heading is the
/// part of the rotation vector about the vertical `up_B`.
[[nodiscard]] inline Eigen::Matrix3d horizontal_covariance(const Matrix6d& P,
                                                           const Eigen::Vector3d& up_B) {
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  J(0, 0) = J(1, 1) = 1.0;
  J.block<1, 3>(2, 3) = up_B.transpose();
  return J * P * J.transpose();
}

}  // namespace dive::estimation
