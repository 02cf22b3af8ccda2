#include "estimation/visual_inertial/filter_options.h"

#include <array>

#include <fmt/format.h>

namespace dive::estimation {
namespace {

struct Bound {
  const char* name;
  double value;
  double low;
  double high;
};

}  // namespace

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
  const std::array<Bound, 34> bounds{{
      {"imu.gyro", imu.gyro, 1e-7, 1.0},
      {"imu.accel", imu.accel, 1e-6, 10.0},
      {"imu.gyro_walk", imu.gyro_walk, 1e-9, 1.0},
      {"imu.accel_walk", imu.accel_walk, 1e-8, 10.0},
      {"gravity", gravity, 9.7, 9.9},
      {"gyro_bias_sigma", gyro_bias_sigma, 1e-7, 1.0},
      {"accel_bias_sigma", accel_bias_sigma, 1e-6, 10.0},
      {"pixel_sigma", pixel_sigma, 0.05, 20.0},
      {"depth_sigma_m", depth_sigma_m, 1e-3, 10.0},
      {"max_clones", 1.0 * max_clones, 4, 30},
      {"max_landmarks", 1.0 * max_landmarks, 0, 60},
      {"max_features", 1.0 * max_features, 10, 2000},
      {"max_update_features", 1.0 * max_update_features, 1, 200},
      {"keyframe_distance_m", keyframe_distance_m, 0.0, 10.0},
      {"keyframe_rotation_deg", keyframe_rotation_deg, 0.0, 90.0},
      {"gate_sigma", gate_sigma, 0.5, 6.0},
      {"scalar_gate_sigma", scalar_gate_sigma, 0.5, 10.0},
      {"extrinsic_sigma_deg", extrinsic_sigma_deg, 1e-4, 30.0},
      {"extrinsic_sigma_m", extrinsic_sigma_m, 1e-6, 1.0},
      {"time_offset_s", time_offset_s, -0.1, 0.1},
      {"time_offset_sigma_s", time_offset_sigma_s, 1e-7, 0.1},
      {"zero_velocity_sigma", zero_velocity_sigma, 1e-4, 1.0},
      {"zero_velocity_pixels", zero_velocity_pixels, 0.0, 20.0},
      {"still_gyro_sigma", still_gyro_sigma, 0.0, 1.0},
      {"still_accel_sigma", still_accel_sigma, 0.0, 10.0},
      {"gyro_limit", gyro_limit, 0.1, 100.0},
      {"accel_limit", accel_limit, 10.0, 1000.0},
      {"longest_imu_step_s", longest_imu_step_s, 0.001, 1.0},
      {"unknown_rate_sigma", unknown_rate_sigma, 1e-3, 10.0},
      {"unknown_accel_sigma", unknown_accel_sigma, 1e-3, 100.0},
      {"hold_back_s", hold_back_s, 0.0, 2.0},
      {"max_speed", max_speed, 0.1, 100.0},
      {"max_position_sigma_m", max_position_sigma_m, 0.01, 1e4},
      {"max_attitude_sigma_deg", max_attitude_sigma_deg, 0.1, 180.0},
  }};
  for (const auto& [name, value, low, high] : bounds) {
    if (value >= low && value <= high) continue;  // false for NaN
    return fmt::format("{} is {} but must be from {} to {}", name, value, low, high);
  }
  if (!(max_rejection_s >= 0.1 && max_rejection_s <= 60.0)) {
    return fmt::format("max_rejection_s is {} but must be from 0.1 to 60", max_rejection_s);
  }
  return {};
}

}  // namespace dive::estimation
