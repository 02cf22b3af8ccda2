#pragma once
// The biases of an IMU as an estimator found them: what a restarted process knows of its unit.

#include <Eigen/Core>

#include "common/clock.h"

namespace dive::estimation {

struct ImuBias {
  Utime utime = 0;                                    ///< Time at which they were estimated.
  Eigen::Vector3d gyro_B = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Vector3d accel_B = Eigen::Vector3d::Zero();  ///< m/s^2
  double gyro_sigma = 0.0;                            ///< One sigma of the least known axis, rad/s.
  double accel_sigma = 0.0;                           ///< The same, m/s^2.
};

}  // namespace dive::estimation
