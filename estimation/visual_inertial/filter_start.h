#pragma once
// Where the filter begins: in motion, at rest, or at a state that is given.

#include <optional>
#include <variant>

#include "common/measurements.h"
#include "estimation/visual_inertial/filter_state.h"
#include "estimation/visual_inertial/imu_buffer.h"

namespace dive::estimation {

/// Attitude from the IMU's own filter, height from depth, velocity from what one swims at. Within
/// a tenth of a second of the first IMU and depth samples.
struct MotionStart {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();  ///< m; z is taken from depth.
  double position_sigma_m = 0.1;                         ///< Horizontally.
  Eigen::Vector3d v_WB_B = Eigen::Vector3d::Zero();      ///< m/s
  double speed_sigma = 0.1;                              ///< m/s, per axis.
  double tilt_sigma_deg = 1.0;                           ///< Of roll and pitch, each.
  double heading_sigma_deg = 2.0;
};

/// Roll and pitch from gravity, gyro bias from its mean, once half a second was still.
struct RestStart {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();
  double position_sigma_m = 0.1;
  double yaw = 0.0;  ///< rad
  double yaw_sigma_deg = 1.0;
};

/// All given, at a time.
struct KnownStart {
  Utime utime = 0;
  Pose X_WB;
  Eigen::Vector3d v_WB_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
  double position_sigma_m = 0.01;
  double tilt_sigma_deg = 0.2;
  double yaw_sigma_deg = 0.2;
  double speed_sigma = 0.02;
};

using FilterStart = std::variant<MotionStart, RestStart, KnownStart>;

/// Empty when usable, else a sentence.
[[nodiscard]] std::string validate(const FilterStart& start);

struct BegunState {
  Utime utime = 0;
  ImuState state;
  Matrix15d covariance;
};

/// Nothing as long as what it takes has not come.
[[nodiscard]] std::optional<BegunState> begin(const FilterStart& start,
                                              const VisualInertialOptions& options,
                                              const ImuBuffer& imu,
                                              const std::optional<DepthSample>& depth);

}  // namespace dive::estimation
