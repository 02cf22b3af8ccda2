#include "planning/world/primitives.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planning/world/nearest_in_hull.h"
#include "planning/world/triangle_soup.h"

namespace dive::planning {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};

// Quilez' folded form: outside, the distance to the clamped point; inside, the nearest face.
double box_distance(const Eigen::Vector3d& half, const Eigen::Vector3d& p) {
  const Eigen::Vector3d beyond = p.cwiseAbs() - half;
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

double cylinder_distance(const Cylinder& cylinder, const Eigen::Vector3d& p) {
  const double radial = p.head<2>().norm() - cylinder.radius;
  const double axial = std::abs(p.z()) - cylinder.length / 2.0;
  return Eigen::Vector2d(radial, axial).cwiseMax(0.0).norm() +
         std::min(std::max(radial, axial), 0.0);
}

double capsule_distance(const Capsule& capsule, const Eigen::Vector3d& p) {
  const double along = std::clamp(p.z(), -capsule.length / 2.0, capsule.length / 2.0);
  return (p - Eigen::Vector3d(0.0, 0.0, along)).norm() - capsule.radius;
}

// The nearest point x of the surface satisfies p_i = x_i (1 + t / r_i^2), with t the root of
//       F(t) = sum (r_i p_i / (r_i^2 + t))^2 - 1
// on t > -min r^2 (Hart 1994, "Distance to an ellipsoid"). F is convex and falling there, so
// Newton's method converges monotonically from the left of the root. For any final t, n ~ p_i /
// (r_i^2 + t) is the normal of a plane that touches the ellipsoid, and the distance to that plane
// never exceeds the distance to the ellipsoid: the result is a lower bound after any number of
// steps.
double ellipsoid_distance(const Ellipsoid& ellipsoid, const Eigen::Vector3d& p) {
  const Eigen::Array3d radii = ellipsoid.radii.array();
  const Eigen::Array3d squared = radii.square();
  Eigen::Index thinnest = 0;
  const double smallest = squared.minCoeff(&thinnest);
  // Here one term of F alone is already 1, so F >= 0: left of the root.
  double t = (radii * p.array().abs() - squared).maxCoeff();
  t = std::max(t, -smallest * (1.0 - 1e-9));
  for (int step = 0; step < 30; ++step) {
    const Eigen::Array3d terms = (radii * p.array() / (squared + t)).square();
    const double value = terms.sum() - 1.0;
    if (value <= 1e-14) break;
    t += value / (2.0 * (terms / (squared + t)).sum());
  }
  const Eigen::Vector3d gradient = (p.array() / (squared + t)).matrix();
  const Eigen::Vector3d normal = gradient.norm() > 0.0
                                     ? Eigen::Vector3d(gradient.normalized())
                                     : Eigen::Vector3d(Eigen::Vector3d::Unit(thinnest));
  const double reach = (radii * normal.array()).matrix().norm();
  // Deep inside, near the plane of symmetry of the thinnest axis, there is no root: the plane of
  // that axis also bounds the depth.
  const double along_thinnest = std::abs(p[thinnest]) - radii[thinnest];
  return std::max(normal.dot(p) - reach, along_thinnest);
}

// Closed form for a triangle: some are kilometres long, where an iteration loses millimetres.
double polytope_distance(const Polytope& polytope, const Eigen::Vector3d& p) {
  const std::vector<Eigen::Vector3d>& v = polytope.vertices;
  if (v.size() == 3) {
    const Eigen::Vector3d ab = v[1] - v[0];
    const Eigen::Vector3d ac = v[2] - v[0];
    const Eigen::Vector3d bc = v[2] - v[1];
    const double longest = std::max({ab.norm(), ac.norm(), bc.norm()});
    if (ab.cross(ac).norm() > 1e-9 * longest * longest) {
      return (nearest_in_triangle({v[0], v[1], v[2]}, p) - p).norm() - polytope.radius;
    }
  }
  return (nearest_in_hull(v, p) - p).norm() - polytope.radius;
}

}  // namespace

Eigen::Vector3d half_extents(const Shape& shape) {
  using Eigen::Vector3d;
  return std::visit(Overloaded{
                        [](const Box& s) -> Vector3d { return s.size / 2.0; },
                        [](const Cylinder& s) -> Vector3d {
                          return {s.radius, s.radius, s.length / 2.0};
                        },
                        [](const Sphere& s) -> Vector3d { return Vector3d::Constant(s.radius); },
                        [](const Capsule& s) -> Vector3d {
                          return {s.radius, s.radius, s.length / 2.0 + s.radius};
                        },
                        [](const Ellipsoid& s) -> Vector3d { return s.radii; },
                        [](const HalfSpace&) -> Vector3d { return Vector3d::Constant(kUnbounded); },
                        [](const Polytope& s) -> Vector3d {
                          Vector3d half = Vector3d::Zero();
                          for (const Vector3d& v : s.vertices) half = half.cwiseMax(v.cwiseAbs());
                          return half.array() + s.radius;
                        },
                    },
                    shape);
}

Eigen::AlignedBox3d bounding_box(const Polytope& polytope, const Pose& X_WO) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : polytope.vertices) box.extend(X_WO * v);
  box.min().array() -= polytope.radius;
  box.max().array() += polytope.radius;
  return box;
}

Eigen::AlignedBox3d bounding_box(const Obstacle& obstacle) {
  using Eigen::Vector3d;
  if (const auto* polytope = std::get_if<Polytope>(&obstacle.shape)) {
    return bounding_box(*polytope, obstacle.X_WO);
  }
  const Eigen::Matrix3d R_WO = obstacle.X_WO.q.toRotationMatrix();
  const Vector3d axis = R_WO.col(2);
  // Extent of a disc of radius 1 across the axis.
  const Vector3d disc = R_WO.leftCols<2>().rowwise().norm();
  const Vector3d half =
      std::visit(Overloaded{
                     [&](const Box& s) -> Vector3d { return R_WO.cwiseAbs() * s.size / 2.0; },
                     [&](const Cylinder& s) -> Vector3d {
                       return axis.cwiseAbs() * s.length / 2.0 + disc * s.radius;
                     },
                     [&](const Sphere& s) -> Vector3d { return Vector3d::Constant(s.radius); },
                     [&](const Capsule& s) -> Vector3d {
                       return axis.cwiseAbs() * s.length / 2.0 + Vector3d::Constant(s.radius);
                     },
                     [&](const Ellipsoid& s) -> Vector3d {
                       return (R_WO * s.radii.asDiagonal()).rowwise().norm();
                     },
                     [](const auto&) -> Vector3d { return Vector3d::Constant(kUnbounded); },
                 },
                 obstacle.shape);
  return {obstacle.X_WO.p - half, obstacle.X_WO.p + half};
}

double signed_distance(const Shape& shape, const Eigen::Vector3d& p_O) {
  return std::visit(Overloaded{
                        [&](const Box& s) { return box_distance(s.size / 2.0, p_O); },
                        [&](const Cylinder& s) { return cylinder_distance(s, p_O); },
                        [&](const Sphere& s) { return p_O.norm() - s.radius; },
                        [&](const Capsule& s) { return capsule_distance(s, p_O); },
                        [&](const Ellipsoid& s) { return ellipsoid_distance(s, p_O); },
                        [&](const HalfSpace& s) { return s.normal.dot(p_O); },
                        [&](const Polytope& s) { return polytope_distance(s, p_O); },
                    },
                    shape);
}

}  // namespace dive::planning
