#pragma once
// Closed forms for the primitives of a world. The narrow phase, the broadphase and the queries of a
// World are built on these.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/world/world.h"

namespace dive::planning {

/// Half edge lengths of the smallest box, aligned with the shape's own frame and centred in it,
/// that contains the shape. A half-space is unbounded: every component is infinite.
[[nodiscard]] Eigen::Vector3d half_extents(const Shape& shape);

/// Smallest box aligned with W that contains the polytope, its radius included.
[[nodiscard]] Eigen::AlignedBox3d bounding_box(const Polytope& polytope, const Pose& X_WO = {});

/// Smallest box aligned with W that contains the obstacle (exact for every bounded shape).
[[nodiscard]] Eigen::AlignedBox3d bounding_box(const Obstacle& obstacle);

/// Signed distance from a point in the shape's frame to its surface, m, negative inside. Exact,
/// with two exceptions: for an ellipsoid it is a lower bound (tight outside and near the surface),
/// and inside the hull of a polytope's vertices it is minus the polytope's radius.
[[nodiscard]] double signed_distance(const Shape& shape, const Eigen::Vector3d& p_O);

}  // namespace dive::planning
