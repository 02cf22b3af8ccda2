#pragma once
// The meshes of a map with their extents, height and volume, which reveal a wrong scale or axis.

#include <nlohmann/json_fwd.hpp>

#include "planning/world/world.h"

namespace dive::mission {

/// [{name, file, triangles, extent_m: [x, y, z], top_z_m, bottom_z_m, volume_m3, closed}], z in W.
/// The volume is negative if the triangles face inwards, and null if the mesh is open.
[[nodiscard]] nlohmann::ordered_json meshes_json(const planning::World& world);

/// The same on stdout, one line per mesh.
void print_meshes(const planning::World& world);

}  // namespace dive::mission
