#pragma once
// What a mesh of a map is made into, as text: kept beside the mesh, and in the log of a dive.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "planning/world/world.h"

namespace dive::planning {

/// Which mesh, at which scale: what its pieces are found by.
struct MeshKey {
  std::string uri;           ///< As the map writes it.
  Eigen::Vector3d scale;     ///< Along the axes of the mesh.
  std::uint64_t digest = 0;  ///< FNV-1a 64 of the mesh's file.
};

struct MeshPieces {
  MeshKey key;
  double tolerance = 0.0;             ///< m that a piece reaches beyond the surface, at most.
  std::vector<Polytope> pieces = {};  ///< In the frame of the mesh, scaled; at least one.
};

/// One piece a line, whole micrometres, then a digest: the same on every machine. Rounding is made
/// up for in the radius of each piece.
[[nodiscard]] std::string to_text(const MeshPieces& mesh);

/// Takes one mesh from the front of `text`. Nothing when it is damaged, or of another version.
[[nodiscard]] std::optional<MeshPieces> take_mesh_pieces(std::string_view& text);

}  // namespace dive::planning
