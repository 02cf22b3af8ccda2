#pragma once
// An AprilTag fixed at a known place (family 36h11): what a mission writes of it, what the
// simulator draws and what the estimator corrects itself by.
//
// Tag frame T, as one looks at the print: origin in the middle, x to the right, y down, z into it.

#include <array>

#include <Eigen/Core>

#include "common/se3.h"

namespace dive {

struct Tag {
  static constexpr int kCodes = 587;  ///< Of the family: ids are 0 to 586.

  int id = 0;
  double size_m = 0.0;  ///< Edge of the black square.
  Pose X_WT;
  double sigma_m = 0.02;   ///< What p_WT errs by, along each axis,
  double sigma_deg = 2.0;  ///< and the attitude, about each.
};

/// Corners of the black square in T: top left, top right, bottom right, bottom left.
[[nodiscard]] inline std::array<Eigen::Vector3d, 4> tag_corners(double size_m) {
  const double h = 0.5 * size_m;
  return {{{-h, -h, 0.0}, {h, -h, 0.0}, {h, h, 0.0}, {-h, h, 0.0}}};
}

/// Attitude of a tag whose print looks towards `yaw`, upright; then pitched up (at 90 degrees it
/// lies face up, and its top points backwards); then turned about its middle, clockwise as one
/// looks at it. All in rad.
[[nodiscard]] Eigen::Quaterniond tag_attitude(double yaw, double pitch_up, double clockwise);

}  // namespace dive
