#pragma once
// Signs of a wrong unit, scale or axis in a mesh of the map. A mesh alone cannot prove an error, so
// these are warnings; the extents that `dive check` and `dive plan` print show the rest.

#include <string>
#include <vector>

#include <Eigen/Core>

#include "planning/world/mesh.h"
#include "planning/world/mesh_facts.h"

namespace dive::planning {

struct MeshRemark {
  const char* code = "";  ///< MAP-MESH-*
  std::string message;    ///< End of a sentence that begins "the mesh ...".
  std::string hint;
};

struct PlacedMesh {
  const MeshFile& file;
  Eigen::Vector3d scale;  ///< Scale as written in the map.
  Eigen::Matrix3d R_WO;   ///< Rotation of the mesh's axes in W.
  MeshFacts facts;        ///< Facts of the mesh in W.
};

/// - MAP-MESH-UNIT: <scale> applies the file's unit again, undoes it, or gives another.
/// - MAP-MESH-UP-AXIS: the file states X_UP or Y_UP, and that axis is more than 45 degrees from the
///   vertical. Not given for Z_UP: there the map itself lays the mesh on its side.
/// - MAP-MESH-UPSIDE-DOWN: the file's up axis, z if it states none, points down in the map by pose
///   or negative scale. A hull that was modelled keel up is not detected.
/// - MAP-MESH-ON-EDGE: over 20 m high, and thinner than 5 % of its height and length: mostly a
///   seabed from a file with y up that does not state it.
/// - MAP-MESH-ABOVE-SURFACE: 90 % of its area is above z = 0: not lowered, or z counts depth.
/// - MAP-MESH-EMERGES: reaches more than 0.5 m and a tenth of its height above z = 0, unless it is
///   as flat as ground (a quarter of its width) that may well rise out of the water.
/// - MAP-MESH-LARGE: over 300 m high or 5 km long: centimetres taken for metres.
[[nodiscard]] std::vector<MeshRemark> remarks_on(const PlacedMesh& mesh);

/// MAP-MESH-SMALL: all meshes of a map together span less than 1 m: metres given as kilometres, or
/// millimetres scaled twice.
[[nodiscard]] std::vector<MeshRemark> remarks_on_all(const Eigen::AlignedBox3d& bounds_W);

}  // namespace dive::planning
