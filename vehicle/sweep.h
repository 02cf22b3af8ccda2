#pragma once
// Convex solids that contain parts at all positions of their joints. Internal to the URDF reader. A
// solid is the convex hull of its points.

#include <vector>

#include <Eigen/Core>
#include <urdf_model/joint.h>
#include <urdf_model/link.h>

#include "common/se3.h"

namespace dive::vehicle {

using Points = std::vector<Eigen::Vector3d>;

/// A polyhedron around a box (exact), a cylinder (16 sides: at most 2 % of the radius beyond it) or
/// a sphere (at most 8 %), in the geometry's frame. Demands one of these.
[[nodiscard]] Points circumscribed(const urdf::Geometry& geometry);

/// A convex solid around everything that `solid`, given in the child link's frame, covers while the
/// joint moves through its range, in the parent link's frame. An arc is replaced by its tangents,
/// so that the solid contains it with an excess of at most 3 mm or 1 % of the radius, whichever is
/// more. Simplified to its bounding box in the joint's frame beyond 256 vertices.
[[nodiscard]] Points swept(const urdf::Joint& joint, const Points& solid);

[[nodiscard]] Pose to_pose(const urdf::Pose& pose);

}  // namespace dive::vehicle
