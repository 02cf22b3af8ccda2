#pragma once
// Solids for the tests of planning/, written independently of the code under test: membership and
// support directly from each shape's definition, directions over the whole sphere.

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <rapidcheck.h>

#include "planning/world/world.h"
#include "test/common/arbitrary.h"

namespace dive::testing {

/// A value of `generator` at full size: rapidcheck begins with the smallest of each range, which
/// would give solids of one size in one corner.
template <class T>
T draw(const rc::Gen<T>& generator) {
  return *rc::gen::resize(rc::kNominalSize, generator);
}

/// A pose without rotation. (In a Pose written as {p, {}} the attitude is not set at all.)
inline Pose still(const Eigen::Vector3d& p) {
  Pose pose;
  pose.p = p;
  return pose;
}

inline double support_value(const planning::Shape& shape, const Eigen::Vector3d& n);
inline std::vector<Eigen::Vector3d> directions(int count);

/// Below 1 inside, 1 on the surface, above 1 outside (half-space: 1 + height over the plane;
/// polytope: 1 + height over the highest of many planes that touch it, slightly too low beside its
/// edges).
inline double membership(const planning::Shape& shape, const Eigen::Vector3d& p) {
  using namespace planning;
  if (const auto* s = std::get_if<Box>(&shape)) {
    return (2.0 * p.array() / s->size.array()).abs().maxCoeff();
  }
  if (const auto* s = std::get_if<Cylinder>(&shape)) {
    return std::max(p.head<2>().norm() / s->radius, std::abs(2.0 * p.z() / s->length));
  }
  if (const auto* s = std::get_if<Sphere>(&shape)) return p.norm() / s->radius;
  if (const auto* s = std::get_if<Capsule>(&shape)) {
    const double over = std::max(std::abs(p.z()) - s->length / 2.0, 0.0);
    return std::hypot(p.head<2>().norm(), over) / s->radius;
  }
  if (const auto* s = std::get_if<Ellipsoid>(&shape)) {
    return (p.array() / s->radii.array()).matrix().norm();
  }
  if (std::holds_alternative<Polytope>(shape)) {
    static const std::vector<Eigen::Vector3d> kNormals = directions(1000);
    double most = -1e300;
    for (const Eigen::Vector3d& n : kNormals)
      most = std::max(most, n.dot(p) - support_value(shape, n));
    return 1.0 + most;
  }
  return 1.0 + std::get<HalfSpace>(shape).normal.dot(p);
}

/// Largest n . x over the shape, n unit: the extreme among its corners, rims and caps.
inline double support_value(const planning::Shape& shape, const Eigen::Vector3d& n) {
  using namespace planning;
  if (const auto* s = std::get_if<Box>(&shape)) {
    double most = -1e300;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d corner((i & 1 ? 0.5 : -0.5) * s->size.x(),
                                   (i & 2 ? 0.5 : -0.5) * s->size.y(),
                                   (i & 4 ? 0.5 : -0.5) * s->size.z());
      most = std::max(most, n.dot(corner));
    }
    return most;
  }
  if (const auto* s = std::get_if<Cylinder>(&shape)) {
    return s->radius * n.head<2>().norm() + std::abs(n.z()) * s->length / 2.0;
  }
  if (const auto* s = std::get_if<Sphere>(&shape)) return s->radius;
  if (const auto* s = std::get_if<Capsule>(&shape)) {
    return s->radius + std::abs(n.z()) * s->length / 2.0;
  }
  if (const auto* s = std::get_if<Ellipsoid>(&shape)) {
    return std::sqrt((s->radii.array().square() * n.array().square()).sum());
  }
  if (const auto* s = std::get_if<Polytope>(&shape)) {
    double most = -1e300;
    for (const Eigen::Vector3d& v : s->vertices) most = std::max(most, n.dot(v));
    return most + s->radius;
  }
  return n.isApprox(std::get<HalfSpace>(shape).normal, 1e-12)
             ? 0.0
             : std::numeric_limits<double>::infinity();
}

/// Separation of two bodies along n: a lower bound on their signed distance, for any n.
inline double separation(std::span<const Eigen::Vector3d> points_W,
                         const planning::Obstacle& obstacle, const Eigen::Vector3d& n_W) {
  double least = 1e300;
  for (const Eigen::Vector3d& p : points_W) least = std::min(least, n_W.dot(p));
  const Eigen::Vector3d n_O = obstacle.X_WO.q.toRotationMatrix().transpose() * n_W;
  return least - n_W.dot(obstacle.X_WO.p) - support_value(obstacle.shape, n_O);
}

/// Evenly spread unit vectors (Fibonacci's spiral); neighbours are about 3.5 / sqrt(count) apart.
inline std::vector<Eigen::Vector3d> directions(int count) {
  std::vector<Eigen::Vector3d> result;
  const double turn = M_PI * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double r = std::sqrt(1.0 - z * z);
    result.emplace_back(r * std::cos(turn * i), r * std::sin(turn * i), z);
  }
  return result;
}

/// The eight corners of a box of that size.
inline std::vector<Eigen::Vector3d> box_corners(const Eigen::Vector3d& size) {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(size.cwiseProduct(
        Eigen::Vector3d(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5)));
  }
  return corners;
}

inline rc::Gen<double> arbitrary_length() { return arbitrary_double(0.1, 3.0); }

inline rc::Gen<Eigen::Vector3d> arbitrary_lengths() {
  return rc::gen::map(rc::gen::tuple(arbitrary_length(), arbitrary_length(), arbitrary_length()),
                      [](const std::tuple<double, double, double>& t) {
                        return Eigen::Vector3d(std::get<0>(t), std::get<1>(t), std::get<2>(t));
                      });
}

/// Any bounded primitive, 0.1 to 3 m in each measure.
inline rc::Gen<planning::Shape> arbitrary_shape() {
  using namespace planning;
  return rc::gen::map(rc::gen::pair(rc::gen::inRange(0, 5), arbitrary_lengths()),
                      [](const std::pair<int, Eigen::Vector3d>& drawn) -> Shape {
                        const Eigen::Vector3d& v = drawn.second;
                        switch (drawn.first) {
                          case 0:
                            return Box{v};
                          case 1:
                            return Cylinder{v.x() / 2.0, v.y()};
                          case 2:
                            return Sphere{v.x() / 2.0};
                          case 3:
                            return Capsule{v.x() / 2.0, v.y()};
                          default:
                            return Ellipsoid{v / 2.0};
                        }
                      });
}

/// Points, lines, flat and solid polytopes, with a radius or nearly none.
inline rc::Gen<planning::Shape> arbitrary_polytope() {
  const auto corners = rc::gen::mapcat(rc::gen::inRange(1, 12), [](int count) {
    return rc::gen::container<std::vector<Eigen::Vector3d>>(static_cast<std::size_t>(count),
                                                            arbitrary_vector(1.0));
  });
  return rc::gen::map(rc::gen::tuple(corners, rc::gen::inRange(0, 3), arbitrary_double(1e-6, 0.2)),
                      [](const auto& drawn) -> planning::Shape {
                        auto [vertices, flat, radius] = drawn;
                        if (flat == 0) {
                          for (Eigen::Vector3d& v : vertices) v.z() = 0.3;
                        }
                        return planning::Polytope{std::move(vertices), flat == 1 ? 1e-6 : radius};
                      });
}

}  // namespace dive::testing
