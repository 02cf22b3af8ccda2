#pragma once
// An AprilTag (family 36h11) at a known, fixed pose: declared by the mission, drawn by the
// simulator, used by the estimator for fixes.
//
// Tag frame T, facing the print: origin in the middle, x to the right, y down, z into the print.

#include <array>

#include <Eigen/Core>

#include "common/se3.h"

namespace dive {

struct Tag {
  static constexpr int kCodes = 587;  ///< Number of codes of the family: ids are 0 to 586.

  int id = 0;
  double size_m = 0.0;  ///< Edge length of the black square.
  Pose X_WT;
  double sigma_m = 0.02;   ///< Standard deviation of p_WT along each axis.
  double sigma_deg = 2.0;  ///< Standard deviation of the attitude about each axis.
};

/// Corners of the black square in T: top left, top right, bottom right, bottom left.
[[nodiscard]] inline std::array<Eigen::Vector3d, 4> tag_corners(double size_m) {
  const double h = 0.5 * size_m;
  return {{{-h, -h, 0.0}, {h, -h, 0.0}, {h, h, 0.0}, {-h, h, 0.0}}};
}

/// Attitude of an upright tag whose outward normal points towards `yaw`; then pitched up (at 90
/// degrees it lies face up, and its top points backwards); then turned clockwise about its middle,
/// as viewed facing the print. All in rad.
[[nodiscard]] Eigen::Quaterniond tag_attitude(double yaw, double pitch_up, double clockwise);

}  // namespace dive
