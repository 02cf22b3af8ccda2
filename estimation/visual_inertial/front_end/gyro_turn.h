#pragma once
// Rotation of the vehicle between two images, by the gyro alone: the prediction of the tracker.

#include <span>

#include <Eigen/Geometry>

#include "common/clock.h"
#include "common/measurements.h"

namespace dive::estimation {

/// Rotation of a camera between two images.
struct CameraTurn {
  Eigen::Quaterniond q_C1C0 = Eigen::Quaterniond::Identity();  ///< p_C1 = q_C1C0 p_C0
  double sigma = 0.0;                                          ///< rad, about the least known axis
};

struct GyroBias {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();  ///< rad/s
  double sigma = 0.0;                               ///< rad/s, of the least known axis
};

/// The turn from `from` to `to` of a camera with the attitude q_BC in the IMU's frame. Samples in
/// the order of time, each valid until the next one, the last one without end.
[[nodiscard]] CameraTurn turn_by_gyro(std::span<const ImuSample> samples, Utime from, Utime to,
                                      const GyroBias& bias, const Eigen::Quaterniond& q_BC);

}  // namespace dive::estimation
