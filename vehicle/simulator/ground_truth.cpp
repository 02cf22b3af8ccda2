#include "vehicle/simulator/ground_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/squared_distance_3.h>

#include "common/assert.h"
#include "vehicle/simulator/triangulation.h"

namespace dive::vehicle {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Triangle = Kernel::Triangle_3;
using Triangles = std::vector<Triangle>;
using Tree = CGAL::AABB_tree<
    CGAL::AABB_traits<Kernel, CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>>>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Rounding in the distances that skipping relies on, generously: m.
constexpr double kSlack = 1e-6;

Point to_point(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

Eigen::Vector3d from_point(const Point& p) { return {p.x(), p.y(), p.z()}; }

Triangles triangles_of(const TriangleSolid& solid) {
  Triangles triangles;
  triangles.reserve(solid.faces.size());
  for (const auto& [a, b, c] : solid.faces) {
    triangles.emplace_back(to_point(solid.vertices[a]), to_point(solid.vertices[b]),
                           to_point(solid.vertices[c]));
  }
  return triangles;
}

double squared_gap(const CGAL::Bbox_3& a, const CGAL::Bbox_3& b) {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double gap = std::max({0.0, a.min(i) - b.max(i), b.min(i) - a.max(i)});
    sum += gap * gap;
  }
  return sum;
}

TriangleSolid moved(const TriangleSolid& solid, const Pose& X_WO) {
  TriangleSolid result = solid;
  for (Eigen::Vector3d& vertex : result.vertices) vertex = X_WO * vertex;
  return result;
}

bool contains(const TriangleSolid& solid, const Eigen::Vector3d& p) {
  return std::all_of(solid.faces.begin(), solid.faces.end(), [&](const auto& face) {
    const Eigen::Vector3d& a = solid.vertices[face[0]];
    const Eigen::Vector3d& b = solid.vertices[face[1]];
    const Eigen::Vector3d& c = solid.vertices[face[2]];
    return (b - a).cross(c - a).dot(p - a) <= 0.0;
  });
}

CGAL::Bbox_3 bounding_box(const TriangleSolid& solid) {
  CGAL::Bbox_3 box;
  for (const Eigen::Vector3d& vertex : solid.vertices) box += to_point(vertex).bbox();
  return box;
}

// A convex solid where it is now.
struct PlacedSolid {
  explicit PlacedSolid(TriangleSolid placed)
      : solid(std::move(placed)), box(bounding_box(solid)), triangles(triangles_of(solid)) {
    for (const Triangle& triangle : triangles) triangle_boxes.push_back(triangle.bbox());
  }

  TriangleSolid solid;
  CGAL::Bbox_3 box;
  Triangles triangles;
  std::vector<CGAL::Bbox_3> triangle_boxes;
};

// Two convex solids whose surfaces are apart overlap only if one holds the other whole, and then
// it holds any vertex of it.
bool one_inside_other(const PlacedSolid& a, const PlacedSolid& b) {
  return CGAL::do_overlap(a.box, b.box) && (contains(a.solid, b.solid.vertices.front()) ||
                                            contains(b.solid, a.solid.vertices.front()));
}

// Branch and bound over the world's tree for the triangle nearest to one solid: the visitor that
// CGAL's tree traversal asks for.
class NearestTriangle {
 public:
  explicit NearestTriangle(double squared_bound) : best_(squared_bound) {}

  [[nodiscard]] bool go_further() const { return best_ > 0.0; }

  template <typename Node>
  [[nodiscard]] bool do_intersect(const PlacedSolid& solid, const Node& node) const {
    return squared_gap(solid.box, node.bbox()) < best_;
  }

  template <typename Primitive>
  void intersection(const PlacedSolid& solid, const Primitive& primitive) {
    const Triangle& wall = *primitive.id();
    const CGAL::Bbox_3 wall_box = wall.bbox();
    if (squared_gap(solid.box, wall_box) >= best_) return;
    // A triangle that lies in the solid whole is not near any of its faces.
    if (CGAL::do_overlap(solid.box, wall_box) &&
        contains(solid.solid, from_point(wall.vertex(0)))) {
      best_ = 0.0;
      return;
    }
    for (std::size_t i = 0; i < solid.triangles.size(); ++i) {
      if (squared_gap(solid.triangle_boxes[i], wall_box) >= best_) continue;
      best_ = std::min(best_, CGAL::squared_distance(solid.triangles[i], wall));
    }
  }

  [[nodiscard]] double squared_distance() const { return best_; }

 private:
  double best_;
};

}  // namespace

struct ClearanceMeter::Impl {
  struct Plane {
    Eigen::Vector3d normal_W;  // out of the solid half
    double offset;             // normal . x of its surface
  };

  Impl(const planning::World& world, const planning::RobotHull& hull) : radius(hull.radius()) {
    for (const planning::ConvexSolid& part : hull.parts) {
      parts_B.push_back(convex_hull(part.vertices));
    }
    for (const planning::Obstacle& obstacle : world.obstacles) add(obstacle);
    for (const planning::Surface& surface : world.surfaces) add(surface.mesh);
    for (const PlacedSolid& solid : solids_W) {
      walls_W.insert(walls_W.end(), solid.triangles.begin(), solid.triangles.end());
    }
    tree.rebuild(walls_W.cbegin(), walls_W.cend());
  }

  void add(const planning::TriangleMesh& mesh) {
    for (const auto& [a, b, c] : mesh.triangles) {
      const Triangle triangle(to_point(mesh.vertices[a]), to_point(mesh.vertices[b]),
                              to_point(mesh.vertices[c]));
      if (!triangle.is_degenerate()) walls_W.push_back(triangle);
    }
  }

  void add(const planning::Obstacle& obstacle) {
    if (obstacle.surface >= 0) return;
    if (const auto* half = std::get_if<planning::HalfSpace>(&obstacle.shape)) {
      const Eigen::Vector3d normal_W = obstacle.X_WO.q * half->normal.normalized();
      planes_W.push_back({normal_W, normal_W.dot(obstacle.X_WO.p)});
    } else {
      solids_W.emplace_back(moved(circumscribed_solid(obstacle.shape), obstacle.X_WO));
    }
  }

  [[nodiscard]] double to_planes(const TriangleSolid& part) const {
    double least = kInfinity;
    for (const Plane& plane : planes_W) {
      for (const Eigen::Vector3d& vertex : part.vertices) {
        least = std::min(least, plane.normal_W.dot(vertex) - plane.offset);
      }
    }
    return std::max(0.0, least);
  }

  // Distance of one part to everything, if it is below `bound`; else `bound`.
  [[nodiscard]] double to_world(const PlacedSolid& part, double bound) const {
    bound = std::min(bound, to_planes(part.solid));
    if (walls_W.empty()) return bound;
    if (bound == kInfinity) {
      // The wall nearest to one corner keeps the search local from the start.
      const Point corner = to_point(part.solid.vertices.front());
      const Point near = tree.closest_point(corner, walls_W.front().vertex(0));
      bound = std::sqrt(CGAL::squared_distance(corner, near)) + kSlack;
    }
    NearestTriangle search(bound * bound);
    tree.traversal(part, search);
    const double distance = std::sqrt(search.squared_distance());
    const bool inside = std::any_of(solids_W.begin(), solids_W.end(), [&](const auto& solid) {
      return one_inside_other(part, solid);
    });
    return inside ? 0.0 : std::min(bound, distance);
  }

  [[nodiscard]] double clearance(const Pose& X_WB) const {
    DIVE_DEMAND(X_WB.is_finite());
    double least = kInfinity;
    for (const TriangleSolid& part_B : parts_B) {
      if (least <= 0.0) break;
      least = to_world(PlacedSolid(moved(part_B, X_WB)), least);
    }
    return least;
  }

  // The clearance cannot have shrunk by more than the farthest a point of the hull has moved.
  [[nodiscard]] double at_least(const Pose& X_WB) const {
    if (!measured) return 0.0;
    return last_clearance - (X_WB.p - last_pose.p).norm() -
           radius * angle_between(last_pose.q, X_WB.q) - kSlack;
  }

  void observe(const Pose& X_WB) {
    const double bound = at_least(X_WB);
    if (bound > 0.0 && bound >= least_clearance) return;
    const double now = clearance(X_WB);
    const bool touches = now <= 0.0;
    if (touches && !(measured && last_clearance <= 0.0)) ++contacts;
    least_clearance = std::min(least_clearance, now);
    last_clearance = now;
    last_pose = X_WB;
    measured = true;
  }

  double radius;
  std::vector<TriangleSolid> parts_B;
  std::vector<PlacedSolid> solids_W;
  std::vector<Plane> planes_W;
  Triangles walls_W;
  Tree tree;

  bool measured = false;
  Pose last_pose;  // of the last exact measurement
  double last_clearance = kInfinity;
  double least_clearance = kInfinity;
  int contacts = 0;
};

ClearanceMeter::ClearanceMeter(const planning::World& world, const planning::RobotHull& hull)
    : impl_(std::make_unique<Impl>(world, hull)) {}
ClearanceMeter::ClearanceMeter(ClearanceMeter&&) noexcept = default;
ClearanceMeter::~ClearanceMeter() = default;

void ClearanceMeter::observe(const Pose& X_WB) { impl_->observe(X_WB); }
double ClearanceMeter::clearance(const Pose& X_WB) const { return impl_->clearance(X_WB); }
double ClearanceMeter::min_clearance_m() const { return impl_->least_clearance; }
int ClearanceMeter::collisions() const { return impl_->contacts; }

}  // namespace dive::vehicle
