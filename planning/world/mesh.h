#pragma once
// Surfaces made of triangles: reading them, and making them into convex obstacles.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "planning/world/world.h"

namespace dive::planning {

/// Reads STL, OBJ, PLY, COLLADA or whatever else Assimp reads; units and node transforms are
/// honoured, COLLADA's up axis is not (as in Gazebo). Triangles may face either way, overlap, hang
/// in the air or not close: only those without area are left out. An error says what is wrong with
/// the file: unreadable, no triangles, numbers that are not finite, beyond `kMostTriangles`.
inline constexpr std::size_t kMostTriangles = 4'000'000;
[[nodiscard]] tl::expected<TriangleMesh, std::string> read_mesh(const std::string& path);

struct DecompositionOptions {
  double tolerance = 0.05;  ///< m that a piece may reach beyond the surface, at most.
  double largest = 25.0;    ///< m from end to end of a piece.
  std::size_t most_pieces = 200'000;
};

/// Convex pieces that hold every point of every triangle, and no point farther than `tolerance`
/// from the surface: walls are covered, what they enclose stays open, and so does a window.
/// A patch is cut in two until the hull of what is left passes both demands. The second is proved
/// by branch and bound with the distance to the surface, whose Lipschitz constant is 1. An error
/// when it would take more pieces than allowed.
[[nodiscard]] tl::expected<std::vector<Polytope>, std::string> decompose(
    const TriangleMesh& mesh, const DecompositionOptions& options);

}  // namespace dive::planning
