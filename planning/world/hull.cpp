// The only file that includes CGAL, whose templates are slow to compile.

#include <algorithm>
#include <cmath>
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

// Distance of the origin from the nearest facet of the part; negative if it is outside.
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
  // A hull with fewer than four vertices has no volume: the vehicle would be a flat sheet.
  DIVE_DEMAND(mesh.number_of_vertices() >= 4);

  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(mesh.number_of_vertices());
  for (const auto vertex : mesh.vertices()) {
    const Kernel::Point_3& p = mesh.point(vertex);
    vertices.emplace_back(p.x(), p.y(), p.z());
  }
  // CGAL orders the border by addresses, so the order of its vertices differs between runs; sums
  // over them must not.
  std::sort(vertices.begin(), vertices.end(), [](const auto& a, const auto& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  return vertices;
}

// Repeatedly adds the vertex farthest outside the hull of those chosen so far.
std::vector<Eigen::Vector3d> RobotHull::outline(double tolerance) const {
  constexpr int kDirections = 2000;
  const std::vector<Eigen::Vector3d> all = hull_vertices();
  Eigen::Matrix3Xd directions(3, kDirections);
  for (int i = 0; i < kDirections; ++i) {  // Fibonacci's spiral: evenly over the sphere
    const double z = 1.0 - (2.0 * i + 1.0) / kDirections;
    const double turn = i * M_PI * (3.0 - std::sqrt(5.0));
    directions.col(i) << std::sqrt(1.0 - z * z) * Eigen::Vector2d(std::cos(turn), std::sin(turn)),
        z;
  }
  Eigen::MatrixXd reach(all.size(), kDirections);
  for (std::size_t v = 0; v < all.size(); ++v) {
    reach.row(static_cast<Eigen::Index>(v)) = all[v].transpose() * directions;
  }
  const Eigen::RowVectorXd full = reach.colwise().maxCoeff();
  Eigen::RowVectorXd taken = reach.row(0);
  std::vector<Eigen::Vector3d> result{all[0]};
  for (;;) {
    Eigen::Index direction = 0;
    if ((full - taken).maxCoeff(&direction) <= tolerance) return result;
    Eigen::Index farthest = 0;
    reach.col(direction).maxCoeff(&farthest);
    taken = taken.cwiseMax(reach.row(farthest));
    result.push_back(all[static_cast<std::size_t>(farthest)]);
  }
}

}  // namespace dive::planning
