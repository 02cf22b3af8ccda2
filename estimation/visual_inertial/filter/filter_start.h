#pragma once
// Initialisation of the filter: in motion, at rest, or at a given state.

#include <optional>
#include <variant>

#include "common/measurements.h"
#include "estimation/visual_inertial/filter/filter_state.h"
#include "estimation/visual_inertial/filter/imu_buffer.h"

namespace dive::estimation {

/// Dynamic initialisation: attitude from the AHRS, height from depth, velocity from the expected
/// speed. Within a tenth of a second of the first IMU and depth samples.
struct MotionStart {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();  ///< m; z is taken from depth.
  double position_sigma_m = 0.1;                         ///< Horizontal sigma.
  Eigen::Vector3d v_WB_B = Eigen::Vector3d::Zero();      ///< m/s
  double speed_sigma = 0.1;                              ///< m/s, per axis.
  double tilt_sigma_deg = 1.0;                           ///< Sigma of roll and of pitch.
  double heading_sigma_deg = 2.0;
};

/// Static initialisation: roll and pitch from gravity, gyro bias from its mean, after half a second
/// at rest.
struct RestStart {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();
  double position_sigma_m = 0.1;
  double yaw = 0.0;  ///< rad
  double yaw_sigma_deg = 1.0;
};

/// Initialisation at a given state and time.
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

/// Empty if usable, else a sentence.
[[nodiscard]] std::string validate(const FilterStart& start);

struct InitialState {
  Utime utime = 0;
  ImuState state;
  Matrix15d covariance;
};

/// Empty until the required samples have arrived.
[[nodiscard]] std::optional<InitialState> begin(const FilterStart& start,
                                                const VisualInertialOptions& options,
                                                const ImuBuffer& imu,
                                                const std::optional<DepthSample>& depth);

}  // namespace dive::estimation
