#pragma once
// The solid environment: a list of convex obstacles in W (ENU, z = 0 at the surface, metres).

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
  double length;  ///< Length along z, centred.
};
struct Sphere {
  double radius;
};
struct Capsule {
  double radius;
  double length;  ///< Length of the cylindrical part along z, centred.
};
struct Ellipsoid {
  Eigen::Vector3d radii;
};
/// The half-space n . x <= 0 in the obstacle's frame, n unit: a seabed, a pool wall.
struct HalfSpace {
  Eigen::Vector3d normal;
};

/// All points within `radius` of the hull of the vertices (at least one, in any position: a
/// triangle is allowed).
struct Polytope {
  std::vector<Eigen::Vector3d> vertices;
  double radius = 0.0;
};

using Shape = std::variant<Box, Cylinder, Sphere, Capsule, Ellipsoid, HalfSpace, Polytope>;

struct Obstacle {
  std::string name;  ///< Name for messages: model, link and collision of the map.
  Shape shape;
  Pose X_WO;
  int surface = -1;  ///< Index in World::surfaces of the surface that this is a piece of, or -1.
};

/// A convex solid: the hull of its vertices, at least four of them not in one plane.
struct ConvexSolid {
  std::string name;
  std::vector<Eigen::Vector3d> vertices;
};

/// The vehicle's shape for planning: convex parts in B whose union contains everything solid,
/// including moving parts over their whole range.
struct RobotHull {
  std::vector<ConvexSolid> parts;

  /// Radius of the smallest ball around B's origin that contains every part, m.
  [[nodiscard]] double radius() const;
  /// Radius of a ball around B's origin that one of the parts contains, m; 0 if no part contains
  /// the origin.
  [[nodiscard]] double inner_radius() const;
  /// Vertices of the convex hull of all parts (no interior points), in B.
  [[nodiscard]] std::vector<Eigen::Vector3d> hull_vertices() const;
  /// A small subset of these whose hull is everywhere within about `tolerance` (m) of the full one.
  [[nodiscard]] std::vector<Eigen::Vector3d> outline(double tolerance) const;
};

/// A surface as modelled, facing either way and not necessarily closed.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// A mesh of the map, in W. Obstacles represent it; the mesh is kept for checks that must not rely
/// on them.
struct Surface {
  std::string name;  ///< Name of its obstacles.
  TriangleMesh mesh;
  std::string file = {};  ///< Source file; empty if the surface was generated.
};

struct World {
  std::vector<Obstacle> obstacles;
  /// Surfaces of the map; empty in a world read back from a log.
  std::vector<Surface> surfaces = {};

  /// Box around everything bounded (half-spaces excluded); empty if there is nothing.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;
};

/// The obstacles [first, end) of one object of a world: all pieces of a mesh, which follow one
/// another, or one obstacle. The index of the first one names the object.
struct ObjectRange {
  int first = 0;
  int end = 0;
};
/// The object that obstacle `index` is part of; demands that there is one. In a world read back
/// from a log each piece of a mesh is an object.
[[nodiscard]] ObjectRange object_at(const World& world, int index);

}  // namespace dive::planning
