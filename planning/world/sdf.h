#pragma once
// SDF worlds (sdformat.org, 1.4 to 1.11): the files Gazebo users already have. Read with libxml2;
// collisions are what counts, visuals are ignored.

#include <optional>
#include <string>

#include "common/diagnostic.h"
#include "common/source_text.h"
#include "planning/world/mesh_source.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Reads world/model/link/collision geometry: box, cylinder, sphere, capsule, ellipsoid, plane, and
/// meshes through their convex pieces, each an obstacle of its own with the collision's name.
/// A plane is a half-space: SDF's <size> only says how much of it is drawn, and is ignored.
/// Obstacles are named by their path, "model/link/collision".
/// Poses (x y z roll pitch yaw, rad; degrees="true" honoured) compose down the tree. What cannot
/// be represented (heightmap, submesh, relative_to frames, include) is an error that names the
/// element: a wall left out is a wall that is swum into. Codes MAP-*. A model that is not static
/// stays where it is drawn, with a warning. Gazebo's sun is the one <include> known to be no wall.
[[nodiscard]] std::optional<World> parse_sdf(SourceText source, Diagnostics& diagnostics,
                                             MeshSource& meshes);

/// Reads the file and parses it, with MeshFiles.
[[nodiscard]] std::optional<World> load_sdf(const std::string& path, Diagnostics& diagnostics);

}  // namespace dive::planning
