#pragma once
// Updates that involve only the IMU's part of the state: depth, expected speed, zero velocity.

#include <Eigen/Core>

#include "estimation/visual_inertial/filter/filter_state.h"

namespace dive::estimation {

/// r = H x + n with H over the IMU's 15 columns.
struct ImuSystem {
  Eigen::MatrixXd H;
  Eigen::VectorXd r;
  Eigen::VectorXd variances;
};

/// z of the sensor at `sensor_B`: p_z + (R l)_z = -depth.
[[nodiscard]] ImuSystem depth_system(const FilterState& state, double depth_m,
                                     const Eigen::Vector3d& sensor_B, double sigma);
/// R^T v = v_B, one sigma per axis of B.
[[nodiscard]] ImuSystem speed_system(const FilterState& state, const Eigen::Vector3d& v_B,
                                     const Eigen::Vector3d& sigma);
/// R^T v = 0 and gyro bias = gyro reading.
[[nodiscard]] ImuSystem zero_velocity_system(const FilterState& state,
                                             const Eigen::Vector3d& gyro_B, double speed_sigma,
                                             double rate_sigma);

enum class UpdateStatus { kAccepted, kGated, kSingular };

struct UpdateResult {
  UpdateStatus status = UpdateStatus::kAccepted;
  double ratio = 0.0;  ///< r^T S^-1 r over the degrees of freedom: 1 on average.
};

/// Updates with `system` unless its innovation exceeds the gate (a quantile, as of a normal).
UpdateResult gated_correct(FilterState& state, const ImuSystem& system, double gate_sigma);

}  // namespace dive::estimation
