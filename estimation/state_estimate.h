#pragma once
// The estimate that every estimator publishes.

#include <cmath>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/planar_transform.h"
#include "common/se3.h"

namespace dive::estimation {

enum class EstimatorKind { kPrimitive, kVisualInertial };
inline constexpr EstimatorKind kLastEstimatorKind = EstimatorKind::kVisualInertial;

/// The name used in missions.
[[nodiscard]] constexpr const char* to_string(EstimatorKind kind) {
  return kind == EstimatorKind::kPrimitive ? "primitive" : "visual_inertial";
}

struct StateEstimate {
  Utime utime = 0;
  bool valid = false;  ///< False until the first attitude and depth have arrived.
  EstimatorKind source = EstimatorKind::kPrimitive;
  Pose X_WB;
  Eigen::Vector3d v_WB_B = Eigen::Vector3d::Zero();      ///< m/s.
  Eigen::Vector3d omega_WB_B = Eigen::Vector3d::Zero();  ///< rad/s.
  /// Covariance of the error (p_true - p, rotation vector of q^-1 q_true): position in W, attitude
  /// in B.
  Matrix6d covariance = Matrix6d::Zero();
  /// Map (W) <- odom correction contained in X_WB, see frame_correction.h. Identity in an
  /// estimator's own estimate.
  PlanarTransform map_from_odom = {};
};

/// The pose by dead reckoning alone, which does not jump when the correction changes.
[[nodiscard]] inline Pose odometry_pose(const StateEstimate& estimate) {
  return estimate.map_from_odom.inverse() * estimate.X_WB;
}

/// One sigma (rad) of the attitude about the worst axis of B.
[[nodiscard]] inline double attitude_sigma(const StateEstimate& estimate) {
  return std::sqrt(estimate.covariance.diagonal().tail<3>().maxCoeff());
}

/// One sigma of the horizontal position along the axis where it is largest, m.
[[nodiscard]] inline double horizontal_sigma(const StateEstimate& estimate) {
  const auto P = estimate.covariance.topLeftCorner<2, 2>();
  const double mean = 0.5 * (P(0, 0) + P(1, 1));
  return std::sqrt(mean + std::hypot(0.5 * (P(0, 0) - P(1, 1)), P(0, 1)));
}

}  // namespace dive::estimation
