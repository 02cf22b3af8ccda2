#pragma once
// Convex hulls of points as closed triangle surfaces.

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace dive::vehicle {

/// A convex solid. Faces list their corners counter-clockwise seen from outside.
struct TriangleSolid {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::size_t, 3>> faces;
};

/// The hull of `points`, by CGAL: the same for the same points, to the last bit and in the same
/// order. (CGAL's convex_hull_3 is not: it orders its work by addresses in memory, so that flat
/// faces are cut into other triangles from run to run.) Demands four points not in one plane.
[[nodiscard]] TriangleSolid convex_hull(std::span<const Eigen::Vector3d> points);

}  // namespace dive::vehicle
