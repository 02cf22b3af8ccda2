#pragma once
// SDF worlds (sdformat.org, 1.4 to 1.11), the file format of Gazebo. Read with libxml2; only
// collisions are used, visuals are ignored.

#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "common/diagnostic.h"
#include "common/geodesy.h"
#include "common/source_text.h"
#include "planning/world/mesh_source.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Reads world/model/link/collision geometry: box, cylinder, sphere, capsule, ellipsoid, plane, and
/// meshes through their convex pieces, each an obstacle of its own with the collision's name. A
/// plane is a half-space: SDF's <size> is only the drawn extent, and is ignored. Obstacles are
/// named by their path, "model/link/collision". Poses (x y z roll pitch yaw, rad; degrees="true"
/// honoured) compose down the tree. Unsupported elements (heightmap, submesh, relative_to frames,
/// include) are errors that name the element, because the vehicle would collide with a wall that
/// was left out. Codes MAP-*. A model that is not static stays at its initial pose, with a warning.
/// The only <include> accepted is Gazebo's sun, which is no obstacle.
[[nodiscard]] std::optional<World> parse_sdf(SourceText source, Diagnostics& diagnostics,
                                             MeshSource& meshes);

/// The text of a map's file, an SDF world or a bathymetric grid (grid.h). The error is a sentence:
/// the file cannot be read, or is larger than 16 MiB.
[[nodiscard]] tl::expected<SourceText, std::string> read_map_text(const std::string& path);

/// The origin that the world states in <spherical_coordinates>: EARTH_WGS84, latitude_deg and
/// longitude_deg, axes ENU. The elevation is ignored, because z = 0 is the surface. Empty without
/// it; also, with the warning MAP-ORIGIN, if the axes are others, and, with the error MAP-NUMBER,
/// if it is no place on the earth. Requires a source that parse_sdf() has accepted.
[[nodiscard]] std::optional<GeoPoint> sdf_origin(const SourceText& source,
                                                 Diagnostics& diagnostics);

/// read_map_text() and parse_sdf() with MeshFiles; an unreadable file gives the diagnostic
/// FILE-UNREADABLE.
[[nodiscard]] std::optional<World> load_sdf(const std::string& path, Diagnostics& diagnostics,
                                            Resources resources = Resources::kInFolder);

}  // namespace dive::planning
