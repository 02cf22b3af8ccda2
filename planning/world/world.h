#pragma once
// What is solid. A world is a list of convex obstacles in W (ENU, z = 0 at the surface, metres).

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/se3.h"

namespace dive::planning {

struct Box {
  Eigen::Vector3d size;  ///< Full edge lengths.
};
struct Cylinder {
  double radius;
  double length;  ///< Along z, centred.
};
struct Sphere {
  double radius;
};
struct Capsule {
  double radius;
  double length;  ///< Of the cylindrical part, along z, centred.
};
struct Ellipsoid {
  Eigen::Vector3d radii;
};
/// The half-space n . x <= 0 in the obstacle's frame, n unit: a seabed, a pool wall.
struct HalfSpace {
  Eigen::Vector3d normal;
};

/// Every point within `radius` of the hull of the vertices (at least one, in any position: a
/// triangle will do).
struct Polytope {
  std::vector<Eigen::Vector3d> vertices;
  double radius = 0.0;
};

using Shape = std::variant<Box, Cylinder, Sphere, Capsule, Ellipsoid, HalfSpace, Polytope>;

struct Obstacle {
  std::string name;  ///< For people: model, link and collision of the map.
  Shape shape;
  Pose X_WO;
  int surface = -1;  ///< Index in World::surfaces of what this is a piece of; -1: of nothing.
};

/// A convex solid: the hull of its vertices, at least four of them not in one plane.
struct ConvexSolid {
  std::string name;
  std::vector<Eigen::Vector3d> vertices;
};

/// The vehicle as the planner sees it: convex parts in B whose union contains everything solid,
/// moving parts over their whole range included.
struct RobotHull {
  std::vector<ConvexSolid> parts;

  /// Radius of the smallest ball around B's origin that holds every part.
  [[nodiscard]] double radius() const;
  /// Radius of a ball around B's origin that one of the parts contains; 0 when none holds it.
  [[nodiscard]] double inner_radius() const;
  /// Vertices of the convex hull of all parts (no interior points), in B.
  [[nodiscard]] std::vector<Eigen::Vector3d> hull_vertices() const;
  /// Some of these, few, whose hull reaches within about `tolerance` (m) of the full one
  /// everywhere.
  [[nodiscard]] std::vector<Eigen::Vector3d> outline(double tolerance) const;
};

/// A surface as it was drawn, facing either way and not necessarily closed.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// A mesh of the map, in W. Obstacles stand for it; it is kept for whoever must not trust them.
struct Surface {
  std::string name;
  TriangleMesh mesh;
};

struct World {
  std::vector<Obstacle> obstacles;
  std::vector<Surface> surfaces = {};  ///< Empty in a world that was read back from a log.

  /// Box around everything bounded (half-spaces excluded); empty when there is nothing.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;
};

}  // namespace dive::planning
