#pragma once
// What lies between a point and the surface.

#include <Eigen/Core>

#include "planning/world/world.h"

namespace dive::planning {

/// Does the obstacle reach into the open vertical tube of `radius` around p_W, from p_W up to the
/// surface z = 0? Exact for boxes and half-spaces; other shapes count as their own box, so the
/// answer may be yes where it is no, never the reverse.
[[nodiscard]] bool is_above(const Obstacle& obstacle, const Eigen::Vector3d& p_W, double radius);

}  // namespace dive::planning
