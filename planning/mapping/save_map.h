#pragma once
// What was seen on a dive becomes a map that the next one can know.

#include <span>
#include <string>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "planning/world/seen.h"

namespace dive::planning {

/// Writes NAME.sdf (one static model), the mesh it refers to, NAME.stl (what is flat of the
/// pieces; a lone point as an octahedron), the pieces themselves, with their radii, where MeshFiles
/// looks for them beside the mesh, and NAME.cloud.ply (`points`). NAME is `path`. In W. Loaded as a
/// map it is the pieces of the dive, to a micrometre; without the file of the pieces, what
/// decompose() makes of the mesh. `comment` becomes a comment in NAME.sdf and NAME.cloud.ply.
/// Each file is there whole or not at all, NAME.sdf last. An error says what is wrong: nothing was
/// seen, too many pieces for a mesh, a NAME that no map can refer to (control characters, not
/// UTF-8, blanks at its ends), or a file that cannot be written.
[[nodiscard]] tl::expected<void, std::string> save_map(const std::string& path, const SeenMap& map,
                                                       std::span<const Eigen::Vector3f> points,
                                                       const std::string& comment);

}  // namespace dive::planning
