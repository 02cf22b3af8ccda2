#pragma once
// What the visual-inertial filter must be told.

#include <string>
#include <vector>

#include "common/camera_model.h"

namespace dive::estimation {

/// White noise as densities, biases as random walks. The defaults are those of an ADIS16448, as
/// EuRoC states them.
struct ImuNoise {
  double gyro = 1.7e-4;        ///< rad/s/sqrt(Hz)
  double accel = 2.0e-3;       ///< m/s^2/sqrt(Hz)
  double gyro_walk = 2.0e-5;   ///< rad/s^2/sqrt(Hz)
  double accel_walk = 3.0e-3;  ///< m/s^3/sqrt(Hz)
};

struct VisualInertialOptions {
  std::vector<CameraModel> cameras;  ///< Left, or left and right; X_BC is where they begin.
  ImuNoise imu;
  double gravity = 9.81;                                     ///< m/s^2
  double gyro_bias_sigma = 0.005;                            ///< rad/s, at the start.
  double accel_bias_sigma = 0.05;                            ///< m/s^2, at the start.
  double pixel_sigma = 0.5;                                  ///< Of a feature, per axis.
  double depth_sigma_m = 0.02;                               ///< Of a depth sample.
  Eigen::Vector3d depth_sensor_B = Eigen::Vector3d::Zero();  ///< Whose height it tells, m.

  int max_clones = 11;                 ///< Poses in the window.
  int max_landmarks = 12;              ///< In the state; 0 leaves a pure MSCKF.
  int max_features = 400;              ///< Of one frame that are followed.
  int max_update_features = 8;         ///< Of one update with nullspace projection.
  double keyframe_distance_m = 0.15;   ///< A clone is kept when so far from the one before,
  double keyframe_rotation_deg = 6.0;  ///< or turned by so much.
  double gate_sigma = 2.0;  ///< Features beyond this quantile of chi^2, as of a normal, are out.
  double scalar_gate_sigma = 3.5;  ///< Likewise depth, speed and standing still.

  bool calibrate_extrinsics = true;
  bool calibrate_time_offset = true;
  double extrinsic_sigma_deg = 0.3;
  double extrinsic_sigma_m = 0.005;
  double time_offset_s = 0.0;  ///< IMU's clock minus the cameras'.
  double time_offset_sigma_s = 0.003;

  double zero_velocity_sigma = 0.01;  ///< m/s, when still.
  double zero_velocity_pixels = 0.8;  ///< Still: the picture moves less in half a second,
  double still_gyro_sigma = 0.02;     ///< the gyro (rad/s) and
  double still_accel_sigma = 0.15;    ///< the accelerometer (m/s^2) scatter less.

  double gyro_limit = 5.2;           ///< rad/s; at or beyond it the gyro is saturated.
  double accel_limit = 78.0;         ///< m/s^2
  double longest_imu_step_s = 0.05;  ///< A longer one is a gap.
  double unknown_rate_sigma = 0.2;   ///< rad/s that the rate may be off in a gap.
  double unknown_accel_sigma = 0.5;  ///< m/s^2 likewise.
  double hold_back_s = 0.15;  ///< So long depth and speed wait for a frame taken before them.

  double max_speed = 3.0;              ///< m/s; beyond it the filter has diverged.
  double max_position_sigma_m = 20.0;  ///< Likewise, horizontally.
  double max_attitude_sigma_deg = 25.0;
  double max_rejection_s = 3.0;  ///< Likewise when all innovations are out for so long.

  /// Empty when usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

}  // namespace dive::estimation
