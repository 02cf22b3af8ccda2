#pragma once
// The front end's output for one image or one pair: observations of landmarks.

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"

namespace dive::estimation {

/// Normalised, undistorted image coordinates [x/z, y/z] in the camera's frame (x to the right, y
/// down, z along the optical axis).
struct FeatureObservation {
  std::int64_t id = 0;                             ///< Constant for a landmark while it is tracked.
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  ///< Position in the left or only camera.
  std::optional<Eigen::Vector2d> right;  ///< Position in the right camera, if it was matched there.
};

struct FeatureFrame {
  Utime utime = 0;  ///< Middle of the exposure, by the camera's clock.
  std::vector<FeatureObservation> features;
};

}  // namespace dive::estimation
