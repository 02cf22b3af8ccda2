#pragma once
// The point of a convex hull that is nearest to a given one.

#include <span>

#include <Eigen/Core>

namespace dive::planning {

/// The point of the hull of `points` nearest to `p` (at least one point; points may coincide, or
/// lie in a plane or on a line). Wolfe 1976, "Finding the nearest point in a polytope": an active
/// set of at most four points, exact up to rounding.
[[nodiscard]] Eigen::Vector3d nearest_in_hull(std::span<const Eigen::Vector3d> points,
                                              const Eigen::Vector3d& p);

}  // namespace dive::planning
