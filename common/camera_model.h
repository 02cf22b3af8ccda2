#pragma once
// A pinhole camera with radial-tangential distortion (Brown 1966; k1, k2, p1, p2 in the order of
// OpenCV and the ASL/EuRoC format). Camera frame C: x to the right, y down, z along the optical
// axis.
//
//   n = [x/z, y/z],  r^2 = n.n
//   d = n (1 + k1 r^2 + k2 r^4) + [2 p1 nx ny + p2 (r^2 + 2 nx^2), p1 (r^2 + 2 ny^2) + 2 p2 nx ny]
//   pixel = [fx dx + cx, fy dy + cy]
//
// Pixel (0, 0) is the centre of the top left pixel.

#include <array>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "common/se3.h"

namespace dive {

struct CameraModel {
  int width = 0;   ///< Pixels.
  int height = 0;  ///< Pixels.
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  std::array<double, 4> radtan{};  ///< k1, k2, p1, p2.
  Pose X_BC;  ///< Pose of the camera in the body (in the IMU where a dataset gives it so).

  /// A description of the first error; empty if the model is usable.
  [[nodiscard]] std::string validate() const;

  /// Normalised image coordinates n to pixels.
  [[nodiscard]] Eigen::Vector2d distort(const Eigen::Vector2d& normalised) const;
  /// Pixels to n, by Newton's method; empty where the distortion has no inverse.
  [[nodiscard]] std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& pixel) const;
  /// A point in C to pixels, perhaps outside the image; empty for a point that is not in front of
  /// the camera.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C) const;
  [[nodiscard]] bool in_image(const Eigen::Vector2d& pixel, double border = 0.0) const;
};

}  // namespace dive
