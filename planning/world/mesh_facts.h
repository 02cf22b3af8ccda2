#pragma once
// Figures by which a person notices a wrong scale or axis of a mesh: extents, height, volume.

#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/world/world.h"

namespace dive::planning {

struct MeshFacts {
  Eigen::AlignedBox3d bounds;  ///< Bounds of its triangles, m.
  double area_m2 = 0.0;
  double area_above_m2 = 0.0;  ///< Area of the triangles whose centre is above z = 0.
  /// True if every edge is used equally often in both directions: the mesh encloses a volume.
  bool is_closed = false;
  /// Volume enclosed by a closed mesh, m3; negative if its triangles face inwards. Absent for an
  /// open mesh.
  std::optional<double> volume_m3;
};

[[nodiscard]] MeshFacts facts_of(const TriangleMesh& mesh);

}  // namespace dive::planning
