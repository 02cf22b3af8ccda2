#pragma once
// Rotation of the vehicle between two images, by the gyro alone: the prediction of the tracker.

#include <span>

#include <Eigen/Geometry>

#include "common/clock.h"
#include "common/measurements.h"

namespace dive::estimation {

/// q_C1C0 (p_C1 = q_C1C0 p_C0) from `from` to `to` of a camera with the attitude q_BC in the IMU's
/// frame. Samples in the order of time, each valid until the next one, the last one without end;
/// `bias` (rad/s) is subtracted.
[[nodiscard]] Eigen::Quaterniond turn_by_gyro(std::span<const ImuSample> samples, Utime from,
                                              Utime to, const Eigen::Vector3d& bias,
                                              const Eigen::Quaterniond& q_BC);

}  // namespace dive::estimation
