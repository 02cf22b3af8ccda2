#pragma once
// The vehicle as described by a URDF file: urdfdom's model types, read with libxml2 (urdfdom's own
// reader would link TinyXML).

#include <optional>
#include <string>

#include <Eigen/Core>

#include "common/diagnostic.h"
#include "common/motion_model.h"
#include "common/source_text.h"
#include "planning/world/world.h"

namespace dive::vehicle {

struct Model {
  std::string name;
  double mass_kg = 0.0;              ///< Mass of all links.
  Eigen::Vector3d centre_of_mass_B;  ///< m.
  Eigen::Matrix3d inertia_B;         ///< Inertia about the centre of mass, kg m^2, joints at zero.
  planning::RobotHull hull;          ///< Collision geometry; moving links over their whole range.
  /// Flipper hips, m: the origins of the joints left_front, left_mid, left_rear, right_front,
  /// right_mid, right_rear. NaN for a vehicle that has none of these joints.
  Eigen::Matrix<double, 3, 6> hips_B;
  MotionModel motion;  ///< By <motion>; the Aqua2's for a description without it.
};

/// Error codes URDF-*. Collision geometry: box, cylinder, sphere (curved shapes as circumscribed
/// polyhedra, never smaller than the part); one hull part each, in the file's order, named after
/// the collision or else the link. A part on moving joints (revolute, prismatic, continuous) is a
/// convex solid around its swept volume between their limits. The root link's frame is B. Visuals,
/// gazebo and transmission elements and foreign namespaces are ignored; xacro and meshes as
/// collision geometry are rejected. <motion> is an extension of ours: motion_element.h.
[[nodiscard]] std::optional<Model> parse_urdf(SourceText source, Diagnostics& diagnostics);
[[nodiscard]] std::optional<Model> load_urdf(const std::string& path, Diagnostics& diagnostics);

/// The Aqua2 of vehicle/aqua2.urdf, compiled into the program.
[[nodiscard]] SourceText aqua2_urdf();

}  // namespace dive::vehicle
