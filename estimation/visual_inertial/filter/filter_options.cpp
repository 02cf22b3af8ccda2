#include "estimation/visual_inertial/filter/filter_options.h"

#include <fmt/format.h>

#include "common/range_check.h"

namespace dive::estimation {
std::string VisualInertialOptions::validate() const {
  if (cameras.empty() || cameras.size() > 2) {
    return fmt::format("cameras are {} but must be one or two", cameras.size());
  }
  for (const CameraModel& camera : cameras) {
    if (const std::string problem = camera.validate(); !problem.empty()) return problem;
  }
  if (!depth_sensor_B.allFinite() || depth_sensor_B.norm() > 10.0) {
    return "depth_sensor_B must be within 10 m of B's origin";
  }
  RangeCheck check;
  check("imu.gyro", imu.gyro, 1e-7, 1.0);
  check("imu.accel", imu.accel, 1e-6, 10.0);
  check("imu.gyro_walk", imu.gyro_walk, 1e-9, 1.0);
  check("imu.accel_walk", imu.accel_walk, 1e-8, 10.0);
  check("imu.gyro_by_accel", imu.gyro_by_accel, 0.0, 0.01);
  check("gravity", gravity, 9.7, 9.9);
  check("gyro_bias_sigma", gyro_bias_sigma, 1e-7, 1.0);
  check("accel_bias_sigma", accel_bias_sigma, 1e-6, 10.0);
  check("imu_scale_sigma", imu_scale_sigma, 0.0, 0.1);
  check("pixel_sigma", pixel_sigma, 0.05, 20.0);
  check("depth_sigma_m", depth_sigma_m, 1e-3, 10.0);
  check("depth_bias_sigma_m", depth_bias_sigma_m, 0.0, 10.0);
  check("max_clones", max_clones, 4, 30);
  check("max_landmarks", max_landmarks, 0, 60);
  check("max_features", max_features, 10, 2000);
  check("max_update_features", max_update_features, 1, 200);
  check("keyframe_distance_m", keyframe_distance_m, 0.0, 10.0);
  check("keyframe_rotation_deg", keyframe_rotation_deg, 0.0, 90.0);
  check("keyframe_period_s", keyframe_period_s, 0.01, 100.0);
  check("gate_sigma", gate_sigma, 0.5, 6.0);
  check("scalar_gate_sigma", scalar_gate_sigma, 0.5, 10.0);
  check("extrinsic_sigma_deg", extrinsic_sigma_deg, 1e-4, 30.0);
  check("extrinsic_sigma_m", extrinsic_sigma_m, 1e-6, 1.0);
  check("time_offset_s", time_offset_s, -0.1, 0.1);
  check("time_offset_sigma_s", time_offset_sigma_s, 1e-7, 0.1);
  check("focal_sigma", focal_sigma, 0.0, 0.1);
  check("centre_sigma_px", centre_sigma_px, 1e-3, 100.0);
  check("refractive_index_sigma", refractive_index_sigma, 0.0, 0.1);
  check("zero_velocity_sigma", zero_velocity_sigma, 1e-4, 1.0);
  check("zero_velocity_pixels", zero_velocity_pixels, 0.0, 20.0);
  check("zero_velocity_gyro_sigma", zero_velocity_gyro_sigma, 0.0, 1.0);
  check("zero_velocity_accel_sigma", zero_velocity_accel_sigma, 0.0, 10.0);
  check("gyro_limit", gyro_limit, 0.1, 100.0);
  check("accel_limit", accel_limit, 10.0, 1000.0);
  check("longest_imu_step_s", longest_imu_step_s, 0.001, 1.0);
  check("unknown_rate_sigma", unknown_rate_sigma, 1e-3, 10.0);
  check("unknown_accel_sigma", unknown_accel_sigma, 1e-3, 100.0);
  check("hold_back_s", hold_back_s, 0.0, 2.0);
  check("max_speed", max_speed, 0.1, 100.0);
  check("max_position_sigma_m", max_position_sigma_m, 0.01, 1e4);
  check("max_attitude_sigma_deg", max_attitude_sigma_deg, 0.1, 180.0);
  check("max_rejection_s", max_rejection_s, 0.1, 60.0);
  return check.problem();
}

}  // namespace dive::estimation
