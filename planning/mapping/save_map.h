#pragma once
// Saves the observed map of a dive as a map for later missions.

#include <span>
#include <string>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "common/output_file.h"
#include "planning/world/observed_map.h"

namespace dive::planning {

/// Writes NAME.sdf (one static model), the mesh that it refers to, NAME.stl (the flat pieces; a
/// lone point as an octahedron), the pieces themselves, with their radii, where MeshFiles searches
/// for them beside the mesh, and NAME.cloud.ply (`points`). NAME is `path`. In W. Loaded as a map,
/// it gives the pieces of the dive, to a micrometre; without the file of pieces, the result of
/// decompose() on the mesh. `comment` becomes a comment in NAME.sdf and NAME.cloud.ply. NAME.sdf is
/// written last: where it has content, all files are complete. Errors: an empty map, too many
/// pieces for a mesh, a NAME that no map can refer to (control characters, not UTF-8, blanks at its
/// ends), all of kind kName, or a file that cannot be written.
[[nodiscard]] tl::expected<void, OutputError> save_map(const std::string& path,
                                                       const ObservedMap& map,
                                                       std::span<const Eigen::Vector3f> points,
                                                       const std::string& comment,
                                                       Existing existing);

}  // namespace dive::planning
