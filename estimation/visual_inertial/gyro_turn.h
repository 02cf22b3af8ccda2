#pragma once
// How the vehicle has turned between two pictures, by the gyro alone: what the tracker predicts by.

#include <span>

#include <Eigen/Geometry>

#include "common/clock.h"
#include "common/measurements.h"

namespace dive::estimation {

/// q_C1C0 (p_C1 = q_C1C0 p_C0) from `from` to `to` of a camera that stands turned by q_BC in the
/// IMU's frame. Samples in the order of time, each holds until the next one, the last one for good;
/// `bias` (rad/s) is taken off.
[[nodiscard]] Eigen::Quaterniond turn_by_gyro(std::span<const ImuSample> samples, Utime from,
                                              Utime to, const Eigen::Vector3d& bias,
                                              const Eigen::Quaterniond& q_BC);

}  // namespace dive::estimation
