#include "vehicle/simulator/ground_truth/ground_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/squared_distance_3.h>

#include "common/assert.h"
#include "vehicle/simulator/ray_tracing/triangulation.h"

namespace dive::vehicle {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Triangle = Kernel::Triangle_3;
using Triangles = std::vector<Triangle>;
using Tree = CGAL::AABB_tree<
    CGAL::AABB_traits<Kernel, CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>>>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Generous bound on the rounding in the distances used for skipping: m.
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

// A convex solid at its present pose.
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

// Two convex solids whose surfaces are apart overlap only if one contains the other, and then it
// contains each of its vertices.
bool one_inside_other(const PlacedSolid& a, const PlacedSolid& b) {
  return CGAL::do_overlap(a.box, b.box) && (contains(a.solid, b.solid.vertices.front()) ||
                                            contains(b.solid, a.solid.vertices.front()));
}

// Squared distance of a solid and a triangle of the world, if it is below `bound`; else `bound`.
double squared_distance_below(const PlacedSolid& solid, const Triangle& wall, double bound) {
  const CGAL::Bbox_3 wall_box = wall.bbox();
  if (squared_gap(solid.box, wall_box) >= bound) return bound;
  // A triangle wholly inside the solid is not near any of its faces.
  if (CGAL::do_overlap(solid.box, wall_box) && contains(solid.solid, from_point(wall.vertex(0)))) {
    return 0.0;
  }
  for (std::size_t i = 0; i < solid.triangles.size(); ++i) {
    if (squared_gap(solid.triangle_boxes[i], wall_box) >= bound) continue;
    bound = std::min(bound, CGAL::squared_distance(solid.triangles[i], wall));
  }
  return bound;
}

// Branch and bound over the world's tree for the triangle nearest to one solid: a visitor for
// CGAL's tree traversal.
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
    const double squared = squared_distance_below(solid, *primitive.id(), best_);
    if (squared >= best_) return;
    best_ = squared;
    nearest_ = primitive.id();
  }

  [[nodiscard]] double squared_distance() const { return best_; }
  /// Empty if no triangle is within the bound.
  [[nodiscard]] const std::optional<Triangles::const_iterator>& nearest() const { return nearest_; }

 private:
  double best_;
  std::optional<Triangles::const_iterator> nearest_;
};

// The visitor for all triangles within a distance of one solid.
template <typename Visit>
class TrianglesWithin {
 public:
  TrianglesWithin(double squared_distance, Visit visit)
      : squared_distance_(squared_distance), visit_(visit) {}

  [[nodiscard]] bool go_further() const { return true; }

  template <typename Node>
  [[nodiscard]] bool do_intersect(const PlacedSolid& solid, const Node& node) const {
    return squared_gap(solid.box, node.bbox()) < squared_distance_;
  }

  template <typename Primitive>
  void intersection(const PlacedSolid& solid, const Primitive& primitive) {
    const double squared = squared_distance_below(solid, *primitive.id(), squared_distance_);
    if (squared < squared_distance_) visit_(primitive.id(), squared);
  }

 private:
  double squared_distance_;
  Visit visit_;
};

// Distance to the nearest obstacle, and its index in Impl::names.
struct Nearest {
  double distance = kInfinity;
  std::size_t obstacle = 0;
};

}  // namespace

struct TriangulatedWorld::Impl {
  struct Plane {
    Eigen::Vector3d normal_W;  // normal out of the solid half-space
    double offset;             // normal . x of its surface
    std::size_t obstacle;

    [[nodiscard]] double distance(const TriangleSolid& part) const {
      double least = kInfinity;
      for (const Eigen::Vector3d& vertex : part.vertices) {
        least = std::min(least, normal_W.dot(vertex) - offset);
      }
      return std::max(0.0, least);
    }
  };
  struct Solid {
    PlacedSolid placed;
    std::size_t obstacle;
  };

  explicit Impl(const planning::World& world) {
    for (const planning::Obstacle& obstacle : world.obstacles) add(obstacle);
    for (const planning::Surface& surface : world.surfaces) add(surface);
    for (const Solid& solid : solids_W) {
      for (const Triangle& triangle : solid.placed.triangles) add(triangle, solid.obstacle);
    }
    // Builds everything that a query would build on demand: queries come from several threads.
    tree.rebuild(walls_W.cbegin(), walls_W.cend());
    if (!walls_W.empty()) tree.accelerate_distance_queries();
  }

  void add(const Triangle& triangle, std::size_t obstacle) {
    walls_W.push_back(triangle);
    wall_obstacles.push_back(obstacle);
  }

  void add(const planning::Surface& surface) {
    const planning::TriangleMesh& mesh = surface.mesh;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Triangle triangle(to_point(mesh.vertices[a]), to_point(mesh.vertices[b]),
                              to_point(mesh.vertices[c]));
      if (!triangle.is_degenerate()) add(triangle, names.size());
    }
    names.push_back(surface.name);
  }

  void add(const planning::Obstacle& obstacle) {
    if (obstacle.surface >= 0) return;
    if (const auto* half = std::get_if<planning::HalfSpace>(&obstacle.shape)) {
      const Eigen::Vector3d normal_W = obstacle.X_WO.q * half->normal.normalized();
      planes_W.push_back({normal_W, normal_W.dot(obstacle.X_WO.p), names.size()});
    } else {
      solids_W.push_back(
          {PlacedSolid(moved(circumscribed_solid(obstacle.shape), obstacle.X_WO)), names.size()});
    }
    names.push_back(obstacle.name);
  }

  [[nodiscard]] std::size_t obstacle_of(Triangles::const_iterator wall) const {
    return wall_obstacles[static_cast<std::size_t>(wall - walls_W.cbegin())];
  }

  // The obstacle nearest to one part, if it is nearer than `best`; else `best`.
  [[nodiscard]] Nearest nearest(const PlacedSolid& part, Nearest best) const {
    for (const Plane& plane : planes_W) {
      const double distance = plane.distance(part.solid);
      if (distance < best.distance) best = {distance, plane.obstacle};
    }
    if (walls_W.empty()) return best;
    double bound = best.distance;
    if (bound == kInfinity) {
      // The wall nearest to one corner keeps the search local from the start.
      const Point corner = to_point(part.solid.vertices.front());
      const Point near = tree.closest_point(corner, walls_W.front().vertex(0));
      bound = std::sqrt(CGAL::squared_distance(corner, near)) + kSlack;
    }
    NearestTriangle search(bound * bound);
    tree.traversal(part, search);
    if (search.nearest()) {
      best = {std::sqrt(search.squared_distance()), obstacle_of(*search.nearest())};
    }
    const auto inside = std::find_if(solids_W.begin(), solids_W.end(), [&](const Solid& solid) {
      return one_inside_other(part, solid.placed);
    });
    return inside != solids_W.end() ? Nearest{0.0, inside->obstacle} : best;
  }

  // Lowers `distances`, by obstacle, to those of one part where they are smaller.
  void take_distances(const PlacedSolid& part, std::vector<double>& distances) const {
    const auto take = [&](std::size_t obstacle, double distance) {
      distances[obstacle] = std::min(distances[obstacle], distance);
    };
    constexpr double kMaxDistance = ClearanceMeter::kReleaseClearance;
    for (const Plane& plane : planes_W) take(plane.obstacle, plane.distance(part.solid));
    TrianglesWithin search(kMaxDistance * kMaxDistance,
                           [&](Triangles::const_iterator wall, double squared) {
                             take(obstacle_of(wall), std::sqrt(squared));
                           });
    tree.traversal(part, search);
    for (const Solid& solid : solids_W) {
      if (one_inside_other(part, solid.placed)) take(solid.obstacle, 0.0);
    }
  }

  std::vector<Solid> solids_W;
  std::vector<Plane> planes_W;
  Triangles walls_W;
  std::vector<std::size_t> wall_obstacles;  // obstacle, by index in walls_W
  std::vector<std::string> names;           // names of the obstacles
  Tree tree;
};

TriangulatedWorld::TriangulatedWorld(const planning::World& world)
    : impl_(std::make_shared<const Impl>(world)) {}

struct ClearanceMeter::Impl {
  Impl(std::shared_ptr<const TriangulatedWorld::Impl> world_in, const planning::RobotHull& hull)
      : world(std::move(world_in)), radius(hull.radius()), in_contact(world->names.size(), false) {
    for (const planning::ConvexSolid& part : hull.parts) {
      parts_B.push_back(convex_hull(part.vertices));
    }
  }

  // The nearest obstacle, if it is nearer than `best`; else `best`.
  [[nodiscard]] Nearest nearest(const Pose& X_WB, Nearest best = {}) const {
    DIVE_DEMAND(X_WB.is_finite());
    for (const TriangleSolid& part_B : parts_B) {
      if (best.distance <= 0.0) break;
      best = world->nearest(PlacedSolid(moved(part_B, X_WB)), best);
    }
    return best;
  }

  // Distance of every obstacle by its index, limited to kReleaseClearance.
  [[nodiscard]] std::vector<double> distances(const Pose& X_WB) const {
    std::vector<double> distances(world->names.size(), kReleaseClearance);
    for (const TriangleSolid& part_B : parts_B) {
      world->take_distances(PlacedSolid(moved(part_B, X_WB)), distances);
    }
    return distances;
  }

  // Upper bound on the motion of any point of the hull since the last measurement.
  [[nodiscard]] double moved_since(const Pose& X_WB) const {
    return (X_WB.p - last_pose.p).norm() + radius * angle_between(last_pose.q, X_WB.q) + kSlack;
  }

  // Result of nearest(X_WB), with the search bounded by the previous distance and the motion since.
  [[nodiscard]] Nearest nearest_now(const Pose& X_WB) const {
    if (!measured || last.distance == kInfinity) return nearest(X_WB);
    return nearest(X_WB, {last.distance + moved_since(X_WB), last.obstacle});
  }

  std::vector<std::string> observe(const Pose& X_WB) {
    const double at_least = measured ? last.distance - moved_since(X_WB) : 0.0;
    if (contacts == 0 && at_least > 0.0 && at_least >= nearest_so_far.distance) return {};
    last = nearest_now(X_WB);
    last_pose = X_WB;
    measured = true;
    if (last.distance < nearest_so_far.distance) nearest_so_far = last;
    if (contacts == 0 && last.distance > 0.0) return {};
    return follow_contacts(distances(X_WB));
  }

  // Returns the names of the obstacles with which a contact begins.
  std::vector<std::string> follow_contacts(const std::vector<double>& distances) {
    std::vector<std::string> started;
    contacts = 0;
    for (std::size_t i = 0; i < in_contact.size(); ++i) {
      if (distances[i] <= 0.0 && !in_contact[i]) started.push_back(world->names[i]);
      in_contact[i] = distances[i] <= 0.0 || (in_contact[i] && distances[i] < kReleaseClearance);
      contacts += in_contact[i] ? 1 : 0;
    }
    return started;
  }

  std::shared_ptr<const TriangulatedWorld::Impl> world;
  double radius;
  std::vector<TriangleSolid> parts_B;

  bool measured = false;
  Nearest last;  // last measurement
  Pose last_pose;
  Nearest nearest_so_far;
  std::vector<bool> in_contact;  // by index in the world's names
  int contacts = 0;              // number of contacts
};

ClearanceMeter::ClearanceMeter(const TriangulatedWorld& world, const planning::RobotHull& hull)
    : impl_(std::make_unique<Impl>(world.impl_, hull)) {}
ClearanceMeter::ClearanceMeter(ClearanceMeter&&) noexcept = default;
ClearanceMeter& ClearanceMeter::operator=(ClearanceMeter&&) noexcept = default;
ClearanceMeter::~ClearanceMeter() = default;

std::vector<std::string> ClearanceMeter::observe(const Pose& X_WB) { return impl_->observe(X_WB); }
double ClearanceMeter::clearance(const Pose& X_WB) const { return impl_->nearest(X_WB).distance; }
double ClearanceMeter::min_clearance_m() const { return impl_->nearest_so_far.distance; }
std::string ClearanceMeter::nearest_obstacle() const {
  return impl_->nearest_so_far.distance < kInfinity
             ? impl_->world->names[impl_->nearest_so_far.obstacle]
             : "";
}

}  // namespace dive::vehicle
