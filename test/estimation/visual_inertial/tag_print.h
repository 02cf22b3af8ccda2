#pragma once
// Pictures of tags whose truth is known, by a pinhole of its own; only the print is the library's.

#include <cstdint>
#include <vector>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "common/se3.h"

namespace dive::estimation::testing {

struct Print {
  int id = 0;
  double size_m = 0.2;
  Pose X_CT;
};

/// Pinhole without distortion, 240 pixels a unit, as the vehicle's; X_BC: looking along x of B.
[[nodiscard]] CameraModel tag_camera();

/// The prints before a grey wall, with noise of so many grey levels.
[[nodiscard]] ImageFrame picture_of(const std::vector<Print>& prints, double noise,
                                    std::uint64_t seed = 1);

/// Corners in pixels: top left, top right, bottom right, bottom left as one looks at the print.
[[nodiscard]] std::vector<Eigen::Vector2d> true_corners(const Print& print);

/// Out of focus, by a box of so many pixels.
void blur(ImageFrame& picture, int width);

}  // namespace dive::estimation::testing
