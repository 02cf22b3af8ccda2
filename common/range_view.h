#pragma once
// What the Aqua2's range camera sees: its field of view and mount.

#include <Eigen/Core>

namespace dive {

/// Pinhole with its optical axis in the plane of B's x and z.
struct RangeView {
  double horizontal_deg = 120.0;
  double vertical_deg = 90.0;
  double tilt_deg = 40.0;                       ///< Optical axis below x of B, deg.
  Eigen::Vector3d origin_B = {0.31, 0.0, 0.0};  ///< m
  double reach_m = 10.0;
};

}  // namespace dive
