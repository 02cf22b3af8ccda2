#pragma once
// Triangles that draw the obstacles of a world, for reports and exports.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "planning/world/world.h"

namespace dive::mission {

/// Triangles in W, part by part.
struct DrawnMesh {
  struct Part {
    std::string name;
    std::size_t triangles = 0;  ///< Number of triangles, after those of the parts before.
  };
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Part> parts;

  /// Appends the hull of the polytope's vertices without its radius: a polygon if it is flat,
  /// nothing if it is a line or a point. Joins the last part if that has the same name.
  void append(const std::string& name, const planning::Polytope& polytope, const Pose& X_WO = {});
  void append(const std::string& name, const planning::TriangleMesh& mesh);

 private:
  void begin(const std::string& name);
};

/// The meshes of a world: its surfaces if they have at most `max_triangles`, else the convex pieces
/// that stand for them; and all other polytopes.
[[nodiscard]] DrawnMesh drawn_meshes(const planning::World& world, std::size_t max_triangles);

/// drawn_meshes() and the other shapes as triangles: round ones within 4 % of their radius,
/// half-spaces as a square that extends 10 m beyond everything else.
[[nodiscard]] DrawnMesh drawn_world(const planning::World& world, std::size_t max_triangles);

}  // namespace dive::mission
