#pragma once
// Triangle meshes: reading them, and decomposing them into convex obstacles.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "planning/world/world.h"

namespace dive::planning {

struct MeshFile {
  /// The mesh, in metres by `unit_m`; every vertex belongs to a triangle, and is unique.
  TriangleMesh mesh;
  std::optional<double> unit_m;  ///< Length of the unit in the file (COLLADA), already applied, m.
  char up_axis = '\0';           ///< 'X', 'Y' or 'Z' as given in the file (COLLADA); not applied.
};

/// Reads STL, OBJ, PLY, COLLADA and the other formats of Assimp, and bathymetric grids (grid.h);
/// units and node transforms are applied, COLLADA's up axis is not (as in Gazebo). Triangles may
/// face either way, overlap, be unconnected or leave gaps. Vertices at the same position are
/// merged, unused ones left out. Files that the mesh names are read only in its own folder or
/// beneath it (assimp_files.h). Errors: an unreadable file, no triangles, numbers that are not
/// finite, more than `kMaxTriangles`.
inline constexpr std::size_t kMaxTriangles = 4'000'000;
[[nodiscard]] tl::expected<MeshFile, std::string> read_mesh(const std::string& path);

struct DecompositionOptions {
  double tolerance = 0.05;  ///< Largest extent of a piece beyond the surface, m.
  double largest = 25.0;    ///< Largest extent of a piece of more than one triangle, m.
  std::size_t max_pieces = 200'000;
};

/// Convex pieces that contain every point of every triangle, and no point farther than `tolerance`
/// from the surface: walls are covered, and the space that they enclose stays open, as does a
/// window. A patch is split in two until the hull of each part meets both requirements. The second
/// is proved by branch and bound with the distance to the surface, whose Lipschitz constant is 1.
/// Error if it would take more pieces than allowed.
[[nodiscard]] tl::expected<std::vector<Polytope>, std::string> decompose(
    const TriangleMesh& mesh, const DecompositionOptions& options);

}  // namespace dive::planning
