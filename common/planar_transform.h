#pragma once
// A change of frame about the vertical, between two frames that both have z up and z = 0 at the
// surface, such as the odometry and map frames.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/se3.h"

namespace dive {

/// p_A = R_z(yaw) p_B + (translation, 0): depth, roll and pitch are the same in both frames.
struct PlanarTransform {
  double yaw = 0.0;                                       ///< rad
  Eigen::Vector2d translation = Eigen::Vector2d::Zero();  ///< m

  [[nodiscard]] Pose operator*(const Pose& pose_B) const {
    return {*this * pose_B.p, (from_rpy(0.0, 0.0, yaw) * pose_B.q).normalized()};
  }
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& p_B) const {
    Eigen::Vector3d p_A = p_B;
    p_A.head<2>() = Eigen::Rotation2Dd(yaw) * p_B.head<2>() + translation;
    return p_A;
  }
  [[nodiscard]] PlanarTransform operator*(const PlanarTransform& other) const {
    return {wrap_angle(yaw + other.yaw), Eigen::Rotation2Dd(yaw) * other.translation + translation};
  }
  [[nodiscard]] PlanarTransform inverse() const {
    return {-yaw, -(Eigen::Rotation2Dd(-yaw) * translation)};
  }
};

}  // namespace dive
