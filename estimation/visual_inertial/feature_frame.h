#pragma once
// What the front end tells the filter of one picture, or of one pair: where landmarks were seen.

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"

namespace dive::estimation {

/// Normalised, undistorted image coordinates [x/z, y/z] in the camera's frame (x to the right, y
/// down, z along the optical axis).
struct FeatureObservation {
  std::int64_t id = 0;  ///< The same landmark keeps it as long as it is tracked.
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  ///< In the left camera, or the only one.
  std::optional<Eigen::Vector2d> right;  ///< In the right one, where it was found there as well.
};

struct FeatureFrame {
  Utime utime = 0;  ///< Middle of the exposure, by the camera's clock.
  std::vector<FeatureObservation> features;
};

}  // namespace dive::estimation
