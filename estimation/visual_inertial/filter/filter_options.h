#pragma once
// Configuration of the visual-inertial filter.

#include <string>
#include <vector>

#include "common/camera_model.h"

namespace dive::estimation {

/// White noise as densities, biases as random walks; what g-sensitivity adds to the gyro's bias is
/// a walk in proportion to the rate. The defaults are those that EuRoC states for an ADIS16448.
struct ImuNoise {
  double gyro = 1.7e-4;        ///< rad/s/sqrt(Hz)
  double accel = 2.0e-3;       ///< m/s^2/sqrt(Hz)
  double gyro_walk = 2.0e-5;   ///< rad/s^2/sqrt(Hz)
  double accel_walk = 3.0e-3;  ///< m/s^3/sqrt(Hz)
  double gyro_by_accel = 0.0;  ///< g-sensitivity, rad/s per m/s^2, as noise in turns.
};

struct VisualInertialOptions {
  std::vector<CameraModel> cameras;  ///< Left, or left and right; X_BC is the initial value.
  ImuNoise imu;
  double gravity = 9.81;          ///< m/s^2
  double gyro_bias_sigma = 0.1;   ///< Turn-on bias of the gyro, rad/s. MEMS units reach 0.1.
  double accel_bias_sigma = 0.2;  ///< Turn-on bias of the accelerometer, m/s^2.
  /// Error of the IMU's scales and axes, per element of ImuIntrinsics; 0: exact, and not estimated.
  double imu_scale_sigma = 0.005;
  double pixel_sigma = 0.5;          ///< Noise of a feature, per axis.
  double depth_sigma_m = 0.02;       ///< Noise of a depth sample.
  double depth_bias_sigma_m = 0.03;  ///< Constant error of depth: tide, air pressure, density.
  Eigen::Vector3d depth_sensor_B = Eigen::Vector3d::Zero();  ///< Position of the depth sensor, m.

  int max_clones = 11;                 ///< Number of poses in the window.
  int max_landmarks = 12;              ///< Number in the state; 0 leaves a pure MSCKF.
  int max_features = 400;              ///< Number of tracked features per frame.
  int max_update_features = 8;         ///< Per update with nullspace projection.
  double keyframe_distance_m = 0.15;   ///< Distance from the previous clone at which one is kept.
  double keyframe_rotation_deg = 6.0;  ///< Rotation from the previous clone at which one is kept.
  double keyframe_period_s = 1.0;      ///< Time after the previous clone at which one is kept.
  double gate_sigma = 2.0;         ///< Gate of features: quantile of chi^2 at this normal sigma.
  double scalar_gate_sigma = 3.5;  ///< Gate of depth, speed and zero-velocity updates.

  bool calibrate_extrinsics = true;
  bool calibrate_time_offset = true;
  double extrinsic_sigma_deg = 0.3;
  double extrinsic_sigma_m = 0.005;
  double time_offset_s = 0.0;  ///< IMU clock minus camera clock.
  double time_offset_sigma_s = 0.003;
  /// Error of the configured focal lengths as a share of them, and of the principal points; 0: the
  /// intrinsics are exact, and not estimated.
  double focal_sigma = 0.0;
  double centre_sigma_px = 1.0;
  /// Error of the configured refractive index before a flat port, the same for all cameras; 0:
  /// exact, and not estimated.
  double refractive_index_sigma = 0.0;

  double zero_velocity_sigma = 0.01;       ///< m/s, the least of a zero-velocity update.
  double zero_velocity_pixels = 0.8;       ///< Maximum image motion at rest, beside noise.
  double zero_velocity_gyro_sigma = 0.1;   ///< Maximum gyro scatter at rest, rad/s.
  double zero_velocity_accel_sigma = 2.0;  ///< Maximum accelerometer scatter at rest, m/s^2.

  double gyro_limit = 5.2;           ///< rad/s; at or beyond it the gyro is saturated.
  double accel_limit = 78.0;         ///< m/s^2; at or beyond it the accelerometer is saturated.
  double longest_imu_step_s = 0.05;  ///< A longer step is a gap.
  double unknown_rate_sigma = 0.2;   ///< Sigma of the angular rate in a gap, rad/s.
  double unknown_accel_sigma = 0.5;  ///< Sigma of the acceleration in a gap, m/s^2.
  double hold_back_s = 0.15;         ///< Maximum wait of depth and speed for an earlier frame.

  double max_speed = 3.0;              ///< Limit of divergence, m/s.
  double max_position_sigma_m = 20.0;  ///< Limit of divergence, horizontally.
  double max_attitude_sigma_deg = 25.0;
  double max_rejection_s = 3.0;  ///< Time of rejecting all innovations until divergence.

  /// Empty if usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

}  // namespace dive::estimation
