#pragma once
// Limits of the vehicle and its path follower, as hinges on consecutive waypoints: on turning, on
// climbing, and on motion across the body's x axis (the certificate holds only if the vehicle swims
// the sweep that was certified).

#include <span>
#include <vector>

#include "common/se3.h"
#include "planning/trajopt/banded_qp.h"
#include "planning/trajopt/trajopt.h"

namespace dive::planning {

/// The hinge weight * max(0, missing - a . x), with x the steps of waypoints `block` and `block +
/// 1`.
struct Hinge {
  int block = 0;
  Vector12d a = Vector12d::Zero();
  /// Violation at a step of zero; negative if the limit is kept with a margin.
  double missing = 0.0;
  double weight = 0.0;

  [[nodiscard]] double cost() const { return weight * std::max(0.0, missing); }
};

/// Appends the hinges of `path` that steps of waypoints by `reach_m` and `reach_rad` can activate.
/// The attitude of waypoint 0, and of the last one if `goal_attitude_fixed`, is given: violations
/// that it causes are not charged to the path.
void add_kinematic_limits(std::span<const Pose> path, const KinematicLimits& limits,
                          AttitudeMode attitude, bool goal_attitude_fixed, double reach_m,
                          double reach_rad, std::vector<Hinge>& out);

}  // namespace dive::planning
