#pragma once
// A camera with one centre of projection: perhaps a flat port before the lens, a lens symmetric
// about its optical axis, then radial-tangential distortion. Camera frame C: x to the right, y
// down, z along the optical axis.
//
//   n = [x/z, y/z]
//
// Behind a flat port, with the refractive index i of the water, a ray at theta_w off the axis
// reaches the lens at sin theta = i sin theta_w (Snell; the glass changes nothing but the place of
// the ray): n becomes n tan theta / tan theta_w. The port is parallel to the image and close to the
// lens: a distance d between them moves the centre of projection along the axis by less than d.
//
//   r = |n|,  theta = atan(r),  m = g(r) n
//
//   pinhole        g = 1
//   equidistant    g = (theta + k1 theta^3 + k2 theta^5 + k3 theta^7 + k4 theta^9) / r
//   EUCM           g = 1 / (alpha sqrt(beta r^2 + 1) + 1 - alpha)
//   double sphere  g = 1 / (alpha sqrt(r^2 + w^2) + (1 - alpha) w),  w = xi sqrt(r^2 + 1) + 1
//
//   s = m.m
//   d = m (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)
//       + [2 p1 mx my + p2 (s + 2 mx^2), p1 (s + 2 my^2) + 2 p2 mx my]
//   pixel = [fx dx + cx, fy dy + cy]
//
// A rolling shutter exposes row v at (v - (height - 1) / 2) line_time_s after the image's stamp.
//
// Sources: Brown, "Decentering distortion of lenses", 1966, with OpenCV's rational term; Kannala
// and Brandt, "A generic camera model and calibration method for conventional, wide-angle, and
// fish-eye lenses", PAMI 2006, in the form of OpenCV's fisheye module; Khomutenko, Garcia and
// Martinet, "An enhanced unified camera model", RA-L 2016; Usenko, Demmel and Cremers, "The double
// sphere camera model", 3DV 2018; Luczynski, Pfingsthorn and Birk, "The Pinax-model for accurate
// and efficient refraction correction of underwater cameras in flat-pane housings", Ocean
// Engineering 2017, for the one centre of projection behind a flat port. The unified model with
// distortion (Mei and Rives 2007; Kalibr's omni) is EUCM with beta = 1, followed by
// radial-tangential distortion.
//
// Pixel (0, 0) is the centre of the top left pixel. Points more than 85 degrees off the optical
// axis have no normalised coordinates here, whatever the lens.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "common/se3.h"

namespace dive {

enum class LensModel : std::uint8_t { kPinhole, kEquidistant, kEucm, kDoubleSphere };

struct CameraModel {
  int width = 0;   ///< Pixels.
  int height = 0;  ///< Pixels.
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  LensModel lens = LensModel::kPinhole;
  /// Equidistant: k1, k2, k3, k4. EUCM: alpha, beta. Double sphere: xi, alpha. The others are 0.
  std::array<double, 4> lens_parameters{};
  std::array<double, 8> radtan{};  ///< k1, k2, p1, p2, k3, k4, k5, k6: OpenCV's order.
  /// Of the water before a flat port; 1: no port, or one that the other numbers contain.
  double refractive_index = 1.0;
  double line_time_s = 0.0;  ///< From one row's exposure to the next; 0: a global shutter.
  Pose X_BC;  ///< Pose of the camera in the body (in the IMU where a dataset gives it so).

  /// A description of the first error; empty if the model is usable. A model that folds over within
  /// the ellipse that touches the image's edges is an error.
  [[nodiscard]] std::string validate() const;

  /// Normalised image coordinates n to pixels, by the formulas alone.
  [[nodiscard]] Eigen::Vector2d distort(const Eigen::Vector2d& normalised) const;
  /// d pixel / d n at n: maps noise of n to pixels, and its inverse noise of pixels to n.
  [[nodiscard]] Eigen::Matrix2d jacobian(const Eigen::Vector2d& normalised) const;
  /// d pixel / d (fx, fy, cx, cy, refractive_index) at n.
  [[nodiscard]] Eigen::Matrix<double, 2, 5> intrinsics_jacobian(
      const Eigen::Vector2d& normalised) const;
  /// Time from the image's stamp to the exposure of that pixel's row, s.
  [[nodiscard]] double row_time(const Eigen::Vector2d& pixel) const {
    return line_time_s * (pixel.y() - 0.5 * (height - 1));
  }
  /// Pixels to n; empty where no ray within 85 degrees of the axis belongs to the pixel, or where
  /// the distortion has no inverse.
  [[nodiscard]] std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& pixel) const;
  /// A point in C to pixels, perhaps outside the image; empty for a point that is not in front of
  /// the camera, more than 85 degrees off the axis, or where the image would fold over.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C) const;
  [[nodiscard]] bool in_image(const Eigen::Vector2d& pixel, double border = 0.0) const;
  /// Pixels per radian on the optical axis: fx and fy alone are that only for a pinhole and an
  /// equidistant lens, without a port.
  [[nodiscard]] double focal() const;
};

}  // namespace dive
