#pragma once
// The position of a landmark from its directions in cameras at known poses: linear least squares on
// the rays, then Gauss-Newton on the image residuals in the inverse-depth coordinates [x/z, y/z,
// 1/z] of the last camera (Montiel, Civera, Davison 2006; Mourikis and Roumeliotis 2007, appendix).

#include <span>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "common/se3.h"

namespace dive::estimation {

/// One camera's observation of it.
struct View {
  Pose X_WC;
  Eigen::Vector2d image;  ///< Normalised image coordinates.
  /// d pixel / d image there; residuals and their noise are in pixels by it.
  Eigen::Matrix2d to_pixels = Eigen::Matrix2d::Identity();
};

struct Triangulated {
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  /// Covariance of p_W for poses without error and noise of 1 pixel along each axis.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double cost = 0.0;  ///< Sum of squared residuals, pixels^2.
};

enum class TriangulationError {
  kTooFewViews,  ///< Fewer than two.
  kNoParallax,   ///< The rays do not determine the depth.
  kBehind,       ///< Behind a camera, or nearer than 0.1 m.
  kTooFar,       ///< Beyond 60 m.
  kNotConverged,
};

/// `sigma` is the noise of a pixel coordinate: a depth whose own sigma exceeds a third of it is
/// kNoParallax.
[[nodiscard]] tl::expected<Triangulated, TriangulationError> triangulate(
    std::span<const View> views, double sigma);

}  // namespace dive::estimation
