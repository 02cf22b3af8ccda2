// The one file that sees CGAL, whose templates are slow to compile.

#include <algorithm>
#include <iterator>
#include <limits>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include "common/assert.h"
#include "planning/world/world.h"

namespace dive::planning {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

void append(const ConvexSolid& part, std::vector<Kernel::Point_3>& points) {
  for (const Eigen::Vector3d& v : part.vertices) points.emplace_back(v.x(), v.y(), v.z());
}

// Distance of the origin to the nearest facet of the part; negative when it is outside.
double origin_depth(const ConvexSolid& part) {
  std::vector<Kernel::Point_3> points;
  append(part, points);
  Mesh mesh;
  CGAL::convex_hull_3(points.begin(), points.end(), mesh);
  double depth = std::numeric_limits<double>::infinity();
  for (const auto facet : mesh.faces()) {
    std::vector<Eigen::Vector3d> corners;
    for (const auto vertex : CGAL::vertices_around_face(mesh.halfedge(facet), mesh)) {
      const Kernel::Point_3& p = mesh.point(vertex);
      corners.emplace_back(p.x(), p.y(), p.z());
    }
    const Eigen::Vector3d outward =
        (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    depth = std::min(depth, outward.dot(corners[0]));
  }
  return depth;
}

}  // namespace

double RobotHull::inner_radius() const {
  double radius = 0.0;
  for (const ConvexSolid& part : parts) radius = std::max(radius, origin_depth(part));
  return radius;
}

std::vector<Eigen::Vector3d> RobotHull::hull_vertices() const {
  std::vector<Kernel::Point_3> points;
  for (const ConvexSolid& part : parts) append(part, points);
  Mesh mesh;
  CGAL::convex_hull_3(points.begin(), points.end(), mesh);
  // Fewer than four would be a hull without volume: a vehicle drawn as a sheet of paper.
  DIVE_DEMAND(mesh.number_of_vertices() >= 4);

  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(mesh.number_of_vertices());
  for (const auto vertex : mesh.vertices()) {
    const Kernel::Point_3& p = mesh.point(vertex);
    vertices.emplace_back(p.x(), p.y(), p.z());
  }
  // CGAL walks its border in the order of addresses, so the order of its vertices is not the same
  // in two runs; a sum over them must be.
  std::sort(vertices.begin(), vertices.end(), [](const auto& a, const auto& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  return vertices;
}

}  // namespace dive::planning
