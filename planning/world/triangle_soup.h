#pragma once
// Distances to the triangles of a mesh, which may have any order and orientation.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/world/box_tree.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Point of triangle `t` nearest to `p`. Ericson, Real-Time Collision Detection, 5.1.5: by the
/// Voronoi region that contains p.
[[nodiscard]] Eigen::Vector3d nearest_in_triangle(const std::array<Eigen::Vector3d, 3>& t,
                                                  const Eigen::Vector3d& p);

class TriangleSoup {
 public:
  /// Leaves out triangles without area. `mesh` must outlive this.
  explicit TriangleSoup(const TriangleMesh& mesh);

  [[nodiscard]] std::size_t size() const { return triangles_.size(); }
  /// Indices into the mesh's vertices.
  [[nodiscard]] const std::array<std::uint32_t, 3>& vertices(std::size_t triangle) const {
    return triangles_[triangle];
  }
  [[nodiscard]] std::array<Eigen::Vector3d, 3> corners(std::size_t triangle) const;
  [[nodiscard]] Eigen::AlignedBox3d box(std::size_t triangle) const;

  [[nodiscard]] double distance(std::size_t triangle, const Eigen::Vector3d& p) const {
    return (nearest_in_triangle(corners(triangle), p) - p).norm();
  }
  /// The triangle nearest to `p`, if one is within `reach` (m).
  [[nodiscard]] std::optional<std::size_t> nearest(const Eigen::Vector3d& p, double reach) const;
  /// Calls `visit(triangle)` for each triangle whose box is within `reach` (m) of `box`.
  template <class Visit>
  void visit(const Eigen::AlignedBox3d& box, double reach, Visit&& visit) const {
    tree_.visit(box, reach, [&](std::size_t i) {
      visit(i);
      return reach;
    });
  }

 private:
  [[nodiscard]] std::vector<Eigen::AlignedBox3d> boxes() const;

  const std::vector<Eigen::Vector3d>& points_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  BoxTree tree_;
};

}  // namespace dive::planning
