#include "planning/world/world_digest.h"

#include <algorithm>
#include <array>
#include <bit>
#include <span>
#include <variant>

#include "common/fnv.h"

namespace dive::planning {
namespace {

class Digest {
 public:
  void add(double value) {
    const auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof(double)>>(value);
    fnv_.add(std::span<const std::uint8_t>(bytes));
  }
  void add(const Eigen::Vector3d& v) {
    for (const double value : v) add(value);
  }
  void add(const Obstacle& obstacle) {
    fnv_.add(obstacle.name);
    add(static_cast<double>(obstacle.shape.index()));
    std::visit([this](const auto& shape) { add(shape); }, obstacle.shape);
    add(obstacle.X_WO.p);
    for (const double value : obstacle.X_WO.q.coeffs()) add(value);
  }
  [[nodiscard]] std::uint64_t value() const { return fnv_.value(); }

 private:
  void add(const Box& box) { add(box.size); }
  void add(const Sphere& sphere) { add(sphere.radius); }
  void add(const Ellipsoid& ellipsoid) { add(ellipsoid.radii); }
  void add(const HalfSpace& half_space) { add(half_space.normal); }
  void add(const Cylinder& cylinder) {
    add(cylinder.radius);
    add(cylinder.length);
  }
  void add(const Capsule& capsule) {
    add(capsule.radius);
    add(capsule.length);
  }
  void add(const Polytope& polytope) {
    add(polytope.radius);
    for (const Eigen::Vector3d& vertex : polytope.vertices) add(vertex);
  }

  Fnv1a64 fnv_;
};

}  // namespace

std::uint64_t world_digest(const World& world) {
  Digest digest;
  for (const Obstacle& obstacle : world.obstacles) digest.add(obstacle);
  return std::max<std::uint64_t>(digest.value(), 1);
}

}  // namespace dive::planning
