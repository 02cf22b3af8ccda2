#pragma once
// Features of a rolling shutter as a global one would show them, for the initialisation, which has
// no poses yet at which the rows were exposed.

#include <span>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"

namespace dive::estimation {

/// Turns every feature by the rotation of `rate_B` (rad/s) between the frame's time and the
/// exposure of its row. What the vehicle swims in that time is left: at 0.4 m/s and a readout of 20
/// ms at most 4 mm.
[[nodiscard]] FeatureFrame at_one_time(FeatureFrame frame, std::span<const CameraModel> cameras,
                                       const Eigen::Vector3d& rate_B);

}  // namespace dive::estimation
