#pragma once
// The vehicle as described by a URDF file: urdfdom's model types, read with libxml2 (urdfdom's own
// reader would link TinyXML).

#include <optional>
#include <string>

#include <Eigen/Core>

#include "common/diagnostic.h"
#include "common/source_text.h"
#include "planning/world/world.h"

namespace dive::vehicle {

struct Model {
  std::string name;
  double mass_kg = 0.0;              ///< All links.
  Eigen::Vector3d centre_of_mass_B;  ///< m.
  Eigen::Matrix3d inertia_B;         ///< About the centre of mass, kg m^2, joints at zero.
  planning::RobotHull hull;          ///< Collision geometry; moving links over their range.
  /// Flipper hips, m: the origins of the joints left_front, left_mid, left_rear, right_front,
  /// right_mid, right_rear. NaN for a vehicle that has none of these joints.
  Eigen::Matrix<double, 3, 6> hips_B;
};

/// Codes URDF-*. Collision geometry: box, cylinder, sphere (curved ones as circumscribed
/// polyhedra: never smaller than the part); one hull part each, in the file's order, named like the
/// collision or else the link. A part on moving joints (revolute, prismatic, continuous) is a
/// convex solid around its sweep between their limits. The root link's frame is B. Visuals, gazebo
/// and transmission elements and what is in a foreign namespace are passed over; xacro and meshes
/// as collision geometry are refused.
[[nodiscard]] std::optional<Model> parse_urdf(SourceText source, Diagnostics& diagnostics);
[[nodiscard]] std::optional<Model> load_urdf(const std::string& path, Diagnostics& diagnostics);

/// The Aqua2 of vehicle/aqua2.urdf, compiled into the program.
[[nodiscard]] SourceText aqua2_urdf();

}  // namespace dive::vehicle
