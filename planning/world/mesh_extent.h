#pragma once
// The largest coordinate of a mesh, and the place in a file that exceeds it.

#include <optional>
#include <string>

#include <Eigen/Core>

#include "planning/world/world.h"

namespace dive::planning {

/// Largest coordinate along each axis from the origin of the mesh, scaled, m. Far beyond the range
/// of a dive, yet single-precision coordinates of a mesh file still have steps of at most a
/// millimetre.
inline constexpr double kMaxMeshExtent = 10'000.0;

struct MeshExcess {
  /// End of a sentence that begins "the mesh ...": the vertex, its value, the limit.
  std::string message;
  std::string hint;
};

/// Absent if every vertex is within the limit. `mesh` is the result of read_mesh() for `path`,
/// multiplied by `scale`; a text file is read again for the line of the vertex.
[[nodiscard]] std::optional<MeshExcess> excess_of(const TriangleMesh& mesh, const std::string& path,
                                                  const Eigen::Vector3d& scale);

}  // namespace dive::planning
