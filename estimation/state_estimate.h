#pragma once
// What every estimator publishes.

#include <cmath>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/se3.h"

namespace dive::estimation {

enum class EstimatorKind { kPrimitive, kVisualInertial };

/// As missions write it.
[[nodiscard]] constexpr const char* to_string(EstimatorKind kind) {
  return kind == EstimatorKind::kPrimitive ? "primitive" : "visual_inertial";
}

struct StateEstimate {
  Utime utime = 0;
  bool valid = false;  ///< False until the first attitude and depth have come.
  EstimatorKind source = EstimatorKind::kPrimitive;
  Pose X_WB;
  Eigen::Vector3d v_WB_B = Eigen::Vector3d::Zero();      ///< m/s.
  Eigen::Vector3d omega_WB_B = Eigen::Vector3d::Zero();  ///< rad/s.
  /// Of the error (p_true - p, rotation vector of q^-1 q_true): position in W, attitude in B.
  Matrix6d covariance = Matrix6d::Zero();
};

/// One sigma of the horizontal position along the axis where it is largest, m.
[[nodiscard]] inline double horizontal_sigma(const StateEstimate& estimate) {
  const auto P = estimate.covariance.topLeftCorner<2, 2>();
  const double mean = 0.5 * (P(0, 0) + P(1, 1));
  return std::sqrt(mean + std::hypot(0.5 * (P(0, 0) - P(1, 1)), P(0, 1)));
}

}  // namespace dive::estimation
