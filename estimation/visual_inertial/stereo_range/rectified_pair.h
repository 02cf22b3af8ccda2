#pragma once
// Two virtual cameras, rotated so that a point is on the same row in both (Fusiello, Trucco, Verri,
// "A compact algorithm for rectification of stereo pairs", 2000). The common frame V: x from the
// left camera to the right one, z midway between the two optical axes and across x, y down. Without
// distortion whatever the lenses, of one focal length, at which they span the view of the lenses up
// to 65 degrees off the axis:
//
//   disparity d = u_left - u_right = f b / z
//
// in pixels, with b the distance between the cameras and z the distance along z of V.

#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "common/camera_model.h"

namespace dive::estimation {

struct RectifiedPair {
  int width = 0;   ///< Pixels, of both cameras, as in the images.
  int height = 0;  ///< Pixels.
  double f = 0.0;  ///< Pixels.
  double cx = 0.0;
  double cy = 0.0;
  double baseline_m = 0.0;
  Pose X_BV;  ///< Pose of the left camera.

  /// Ray of the pixel (u, v) of the left image, in V: [x, y, 1].
  [[nodiscard]] Eigen::Vector3d ray(double u, double v) const {
    return {(u - cx) / f, (v - cy) / f, 1.0};
  }
  /// Depth along z of V, m, of a disparity above 0.
  [[nodiscard]] double depth(double disparity_px) const { return f * baseline_m / disparity_px; }
};

/// An error is a sentence: cameras that are not valid, of different sizes, less than a millimetre
/// apart or with axes more than 45 degrees apart, or of which the second is not right of the first.
[[nodiscard]] tl::expected<RectifiedPair, std::string> rectify(const CameraModel& left,
                                                               const CameraModel& right);

/// Position in the image of `camera` of each pixel of the rectified one, row by row; NaN outside
/// the lens's field of view.
[[nodiscard]] std::vector<Eigen::Vector2f> seen_from(const RectifiedPair& pair,
                                                     const CameraModel& camera);

}  // namespace dive::estimation
