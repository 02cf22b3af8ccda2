#include "vehicle/simulator/ray_tracing/triangulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <variant>
#include <vector>

namespace dive::vehicle {
namespace {

using planning::Box;
using planning::Capsule;
using planning::Cylinder;
using planning::Ellipsoid;
using planning::HalfSpace;
using planning::Sphere;
using Points = std::vector<Eigen::Vector3d>;
using std::numbers::pi;

constexpr int kCylinderSides = 64;
constexpr int kSpherePoints = 1000;

Points box_corners(const Eigen::Vector3d& size) {
  Points corners;
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      for (const double z : {-0.5, 0.5}) {
        corners.push_back(size.cwiseProduct(Eigen::Vector3d(x, y, z)));
      }
    }
  }
  return corners;
}

Points cylinder_rims(double radius, double length) {
  Points points;
  const double outside = radius / std::cos(pi / kCylinderSides);
  for (int i = 0; i < kCylinderSides; ++i) {
    const double angle = 2.0 * pi * i / kCylinderSides;
    points.emplace_back(outside * std::cos(angle), outside * std::sin(angle), -0.5 * length);
    points.emplace_back(outside * std::cos(angle), outside * std::sin(angle), 0.5 * length);
  }
  return points;
}

// Distance from the origin, which is inside, to the nearest face.
double inner_radius(const TriangleSolid& solid) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : solid.faces) {
    const Eigen::Vector3d& corner = solid.vertices[a];
    const Eigen::Vector3d normal =
        (solid.vertices[b] - corner).cross(solid.vertices[c] - corner).normalized();
    least = std::min(least, normal.dot(corner));
  }
  return least;
}

// Corners of a polyhedron around the unit sphere: points spread evenly along a spiral by the golden
// angle, moved outwards until the nearest face of their hull touches the sphere.
Points around_unit_sphere() {
  const double golden_angle = pi * (3.0 - std::sqrt(5.0));
  Points points;
  for (int i = 0; i < kSpherePoints; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kSpherePoints;
    const double ring = std::sqrt(1.0 - z * z);
    points.emplace_back(ring * std::cos(i * golden_angle), ring * std::sin(i * golden_angle), z);
  }
  const double grow = 1.0 / inner_radius(convex_hull(points));
  for (Eigen::Vector3d& point : points) point *= grow;
  return points;
}

Points ellipsoid_points(const Eigen::Vector3d& radii) {
  Points points = around_unit_sphere();
  for (Eigen::Vector3d& point : points) point = point.cwiseProduct(radii);
  return points;
}

// A capsule is a sphere swept along its axis, and its polyhedron is the sphere's polyhedron swept
// likewise.
Points capsule_points(const Capsule& capsule) {
  Points points;
  for (const Eigen::Vector3d& unit : around_unit_sphere()) {
    for (const double z : {-0.5 * capsule.length, 0.5 * capsule.length}) {
      points.push_back(capsule.radius * unit + Eigen::Vector3d(0.0, 0.0, z));
    }
  }
  return points;
}

struct CornersOf {
  Points operator()(const Box& box) const { return box_corners(box.size); }
  Points operator()(const Cylinder& cylinder) const {
    return cylinder_rims(cylinder.radius, cylinder.length);
  }
  Points operator()(const Sphere& sphere) const {
    return ellipsoid_points(Eigen::Vector3d::Constant(sphere.radius));
  }
  Points operator()(const Capsule& capsule) const { return capsule_points(capsule); }
  Points operator()(const Ellipsoid& ellipsoid) const { return ellipsoid_points(ellipsoid.radii); }
  Points operator()(const HalfSpace&) const { return {}; }
  Points operator()(const planning::Polytope& polytope) const {
    Points points;
    for (const Eigen::Vector3d& v : polytope.vertices) {
      for (const Eigen::Vector3d& c :
           box_corners(Eigen::Vector3d::Constant(2.0 * polytope.radius))) {
        points.push_back(v + c);
      }
    }
    return points;
  }
};

}  // namespace

TriangleSolid circumscribed_solid(const planning::Shape& shape) {
  return convex_hull(std::visit(CornersOf{}, shape));
}

}  // namespace dive::vehicle
