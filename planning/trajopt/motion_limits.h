#pragma once
// What the vehicle and its follower cannot do, as hinges on consecutive waypoints: turn faster than
// they can, climb steeper, or swim much across the body's x axis (a sweep that the certificate
// looks at must be the one that is swum).

#include <span>
#include <vector>

#include "common/se3.h"
#include "planning/trajopt/banded_qp.h"
#include "planning/trajopt/trajopt.h"

namespace dive::planning {

/// weight * max(0, missing - a . x), x being the steps of waypoints `block` and `block + 1`.
struct Hinge {
  int block = 0;
  Vector12d a = Vector12d::Zero();
  double missing = 0.0;  ///< At a step of zero; negative when there is room.
  double weight = 0.0;

  [[nodiscard]] double cost() const { return weight * std::max(0.0, missing); }
};

/// Appends the hinges of `path` that a step of waypoints by `reach_m` and `reach_rad` can bring
/// into play. Waypoint 0's attitude, and the last one's when `goal_attitude_fixed`, are as they
/// are: what they miss is not held against the path.
void add_motion_limits(std::span<const Pose> path, const MotionLimits& limits,
                       AttitudeMode attitude, bool goal_attitude_fixed, double reach_m,
                       double reach_rad, std::vector<Hinge>& out);

}  // namespace dive::planning
