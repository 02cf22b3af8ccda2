#pragma once
// Images of tags with a known truth, by an independent pinhole; only the print is the library's.

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

/// Pinhole without distortion, f = 240 pixels, as the vehicle's; X_BC: facing along x of B.
[[nodiscard]] CameraModel tag_camera();

/// The prints before a grey wall, with `noise` in grey levels.
[[nodiscard]] ImageFrame image_of(const std::vector<Print>& prints, double noise,
                                  std::uint64_t seed = 1);

/// Corners in pixels: top left, top right, bottom right, bottom left, facing the print.
[[nodiscard]] std::vector<Eigen::Vector2d> true_corners(const Print& print);

/// Defocuses by a box of `width` pixels.
void blur(ImageFrame& image, int width);

}  // namespace dive::estimation::testing
