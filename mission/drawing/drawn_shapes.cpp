// Points whose convex hull draws a shape.

#include <cmath>
#include <numbers>
#include <variant>

#include "mission/drawing/drawn_mesh.h"

namespace dive::mission {
namespace {

using Eigen::Vector3d;

constexpr int kSides = 16;        // of a circle
constexpr int kRings = 8;         // from pole to pole
constexpr double kMargin = 10.0;  // m of a half-space beyond everything else
constexpr double kThickness = 0.01;

// Corners of a ring of `radius` at height `z`.
void add_ring(double radius, double z, std::vector<Vector3d>& points) {
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kSides;
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
}

// A unit ball.
std::vector<Vector3d> ball() {
  std::vector<Vector3d> points{{0.0, 0.0, 1.0}, {0.0, 0.0, -1.0}};
  for (int i = 1; i < kRings; ++i) {
    const double latitude = std::numbers::pi * i / kRings;
    add_ring(std::sin(latitude), std::cos(latitude), points);
  }
  return points;
}

std::vector<Vector3d> box(const Vector3d& size) {
  std::vector<Vector3d> points;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d sign((corner & 1) != 0 ? 0.5 : -0.5, (corner & 2) != 0 ? 0.5 : -0.5,
                        (corner & 4) != 0 ? 0.5 : -0.5);
    points.emplace_back(sign.cwiseProduct(size));
  }
  return points;
}

struct HullPoints {
  const Eigen::AlignedBox3d& bounds;
  const Pose& X_WO;

  std::vector<Vector3d> operator()(const planning::Box& shape) const { return box(shape.size); }
  std::vector<Vector3d> operator()(const planning::Cylinder& shape) const {
    std::vector<Vector3d> points;
    add_ring(shape.radius, -0.5 * shape.length, points);
    add_ring(shape.radius, 0.5 * shape.length, points);
    return points;
  }
  std::vector<Vector3d> operator()(const planning::Sphere& shape) const {
    return (*this)(planning::Ellipsoid{Vector3d::Constant(shape.radius)});
  }
  std::vector<Vector3d> operator()(const planning::Capsule& shape) const {
    std::vector<Vector3d> points = ball();
    for (Vector3d& p : points) {
      p = shape.radius * p + Vector3d(0.0, 0.0, std::copysign(0.5 * shape.length, p.z()));
    }
    add_ring(shape.radius, -0.5 * shape.length, points);
    return points;
  }
  std::vector<Vector3d> operator()(const planning::Ellipsoid& shape) const {
    std::vector<Vector3d> points = ball();
    for (Vector3d& p : points) p = p.cwiseProduct(shape.radii);
    return points;
  }
  // A thin plate below the plane, under the middle of the world.
  std::vector<Vector3d> operator()(const planning::HalfSpace& shape) const {
    const bool is_empty = bounds.isEmpty();
    const Vector3d middle = X_WO.inverse() * (is_empty ? X_WO.p : Vector3d(bounds.center()));
    const double size = (is_empty ? 0.0 : bounds.diagonal().norm()) + 2.0 * kMargin;
    const Vector3d n = shape.normal.normalized();
    const Eigen::Quaterniond q = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), n);
    std::vector<Vector3d> points = box({size, size, kThickness});
    for (Vector3d& p : points) {
      p = middle - n.dot(middle) * n + q * (p - Vector3d(0.0, 0.0, 0.5 * kThickness));
    }
    return points;
  }
  std::vector<Vector3d> operator()(const planning::Polytope&) const { return {}; }
};

}  // namespace

DrawnMesh drawn_world(const planning::World& world, std::size_t max_triangles) {
  DrawnMesh drawn = drawn_meshes(world, max_triangles);
  const Eigen::AlignedBox3d bounds = world.bounds();
  for (const planning::Obstacle& obstacle : world.obstacles) {
    const std::vector<Vector3d> points =
        std::visit(HullPoints{bounds, obstacle.X_WO}, obstacle.shape);
    if (!points.empty()) drawn.append(obstacle.name, planning::Polytope{points}, obstacle.X_WO);
  }
  return drawn;
}

}  // namespace dive::mission
