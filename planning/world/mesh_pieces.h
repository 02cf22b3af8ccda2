#pragma once
// The pieces of a map's mesh as text: stored beside the mesh, and in the log of a dive.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "planning/world/world.h"

namespace dive::planning {

/// The mesh and its scale: the key of its pieces.
struct MeshKey {
  std::string uri;           ///< URI as written in the map.
  Eigen::Vector3d scale;     ///< Scale along the axes of the mesh.
  std::uint64_t digest = 0;  ///< FNV-1a 64 digest of the mesh's file.
};

struct MeshPieces {
  MeshKey key;
  double tolerance = 0.0;             ///< Largest extent of a piece beyond the surface, m.
  std::vector<Polytope> pieces = {};  ///< At least one piece, in the frame of the mesh, scaled.
};

/// One piece per line in whole micrometres, then a digest: the same on every machine. The radius of
/// each piece covers the rounding.
[[nodiscard]] std::string to_text(const MeshPieces& mesh);

/// Removes one mesh from the front of `text`. Absent if it is damaged, or of another version.
[[nodiscard]] std::optional<MeshPieces> take_mesh_pieces(std::string_view& text);

}  // namespace dive::planning
