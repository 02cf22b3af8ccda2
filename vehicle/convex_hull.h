#pragma once
// Convex hulls of points as closed triangle surfaces.

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace dive::vehicle {

/// A convex solid. Faces list their corners counter-clockwise as viewed from outside.
struct TriangleSolid {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::size_t, 3>> faces;
};

/// The hull of `points`, by CGAL: bit-identical for equal points, in the same order. (CGAL's
/// convex_hull_3 is not: its order depends on memory addresses, so that it cuts flat faces into
/// different triangles from run to run.) Demands four points that are not in one plane.
[[nodiscard]] TriangleSolid convex_hull(std::span<const Eigen::Vector3d> points);

}  // namespace dive::vehicle
