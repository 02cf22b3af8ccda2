#pragma once
// Gravity and the direction of travel over a window, to begin a fit with. The direction is that of
// the epipolar constraint between the first frame and a later one, given the rotation by the gyro;
// its sign is the one with the points before the camera. Internal.

#include <optional>

#include "common/se3.h"
#include "estimation/visual_inertial/filter/start_window.h"

namespace dive::estimation {

struct FirstMotion {
  Eigen::Vector3d up_B = Eigen::Vector3d::UnitZ();         ///< Mean specific force, in B0, m/s^2.
  Eigen::Vector3d direction_B = Eigen::Vector3d::UnitX();  ///< Of travel, in B0, unit.
  double seconds = 0.0;                                    ///< Over which it was found.
  /// Part of the displacement over `seconds` that the IMU gives: B0, m.
  Eigen::Vector3d by_imu_B = Eigen::Vector3d::Zero();

  /// Velocity in B0 at the first frame for a mean speed of travel (m/s).
  [[nodiscard]] Eigen::Vector3d velocity(double speed) const {
    return speed * direction_B - by_imu_B / seconds;
  }
};

/// Empty if too few points are seen from both.
[[nodiscard]] std::optional<FirstMotion> find_first_motion(const StartWindow& window,
                                                           const Pose& X_BC,
                                                           const Eigen::Vector3d& gyro_bias);

}  // namespace dive::estimation
