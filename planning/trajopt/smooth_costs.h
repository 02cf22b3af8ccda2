#pragma once
// The smooth terms of a path's cost: length, attitude along the motion, turning, lying level. Each
// has a value and adds its convex model, as a function of the step (dp in W, rotation vector in B)
// of every waypoint, to a quadratic programme.

#include <span>

#include "common/se3.h"
#include "planning/trajopt/banded_qp.h"
#include "planning/trajopt/trajopt.h"

namespace dive::planning {

/// Parameters of the terms.
struct SmoothCosts {
  double length_weight = 100.0;
  double attitude_weight = 20.0;
  double turn_weight = 5.0;
  double upright_weight = 2.0;
  AttitudeMode attitude = AttitudeMode::kFree;
  /// Length of the path about which the model is built, m. The length term is
  ///       E = w/2 (N sum |dp_i|^2 / L_ref + L_ref)  >=  w L,
  /// with equality for N even segments and L_ref = L (Cauchy-Schwarz, then the means): quadratic,
  /// block-tridiagonal, with the minimum of w L, and it keeps the waypoints evenly spaced.
  double reference_length = 1.0;

  [[nodiscard]] double value(std::span<const Pose> path) const;

  /// Adds the model about `path` to `qp`, whose block i is waypoint i; the constant is left out.
  /// Attitude and turn terms are modelled by Gauss-Newton.
  void add_to(std::span<const Pose> path, BandedQp& qp) const;
};

/// Angles (rad) between the body's x axis and the direction of motion `motion_W`: a vector along
/// (y, z) of the body whose norm is the angle. In kHorizontal only the heading counts. Zero without
/// motion.
[[nodiscard]] Eigen::Vector2d heading_error(const Eigen::Quaterniond& q_WB,
                                            const Eigen::Vector3d& motion_W, AttitudeMode attitude);

/// The heading error of pose `a` (which = 0) or `b` (1) and the motion from a to b, with its
/// derivative by the steps (dp in W, rotation vector in B) of both.
[[nodiscard]] Eigen::Vector2d heading_error_model(const Pose& a, const Pose& b, int which,
                                                  AttitudeMode attitude,
                                                  Eigen::Matrix<double, 2, 12>& J);

}  // namespace dive::planning
