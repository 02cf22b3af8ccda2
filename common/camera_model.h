#pragma once
// A pinhole camera with radial-tangential distortion (Brown 1966; k1, k2, p1, p2 as OpenCV and the
// ASL/EuRoC format order them). Camera frame C: x to the right, y down, z along the optical axis.
//
//   n = [x/z, y/z],  r^2 = n.n
//   d = n (1 + k1 r^2 + k2 r^4) + [2 p1 nx ny + p2 (r^2 + 2 nx^2), p1 (r^2 + 2 ny^2) + 2 p2 nx ny]
//   pixel = [fx dx + cx, fy dy + cy]
//
// Pixel (0, 0) is the middle of the first one, top left.

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
  Pose X_BC;  ///< Of the camera in the body (or in the IMU, where data say so).

  /// What is wrong with it, for people; empty when it can be used.
  [[nodiscard]] std::string validate() const;

  /// Normalised image coordinates n to pixels.
  [[nodiscard]] Eigen::Vector2d distort(const Eigen::Vector2d& normalised) const;
  /// Pixels to n, by Newton's method; nothing where the distortion cannot be undone.
  [[nodiscard]] std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& pixel) const;
  /// A point in C to pixels; nothing for one that is not before the camera. May lie outside of the
  /// picture.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C) const;
  [[nodiscard]] bool in_picture(const Eigen::Vector2d& pixel, double border = 0.0) const;
};

}  // namespace dive
