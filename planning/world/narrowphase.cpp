#include "planning/world/narrowphase.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "planning/world/corral.h"
#include "planning/world/primitives.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using Points = const SolidPoints&;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Gap (m) below which the two nearest points define no direction.
constexpr double kTouching = 1e-6;
// Gap (m) to which overlapping bodies are separated for a query; see climb().
constexpr double kParted = 0.1;
constexpr double kNudge = 1e-3;  // Least shift, m, also of bodies that are already that far apart.
constexpr int kMaxIterations = 100;

// --- Support functions: the farthest point along n, of any length except zero. ---
// Rounded shapes enter GJK as their core (a point, a segment) and a radius to subtract: exact, and
// most overlaps become plain distances between cores.

Vector3d core_support(const Box& box, const Vector3d& n) {
  const Vector3d half = box.size / 2.0;
  return {std::copysign(half.x(), n.x()), std::copysign(half.y(), n.y()),
          std::copysign(half.z(), n.z())};
}
Vector3d core_support(const Cylinder& cylinder, const Vector3d& n) {
  const double radial = std::hypot(n.x(), n.y());
  const double scale = radial > 0.0 ? cylinder.radius / radial : 0.0;
  return {n.x() * scale, n.y() * scale, std::copysign(cylinder.length / 2.0, n.z())};
}
Vector3d core_support(const Sphere&, const Vector3d&) { return Vector3d::Zero(); }
Vector3d core_support(const Capsule& capsule, const Vector3d& n) {
  return {0.0, 0.0, std::copysign(capsule.length / 2.0, n.z())};
}
Vector3d core_support(const Ellipsoid& ellipsoid, const Vector3d& n) {
  const Vector3d scaled = ellipsoid.radii.cwiseProduct(n);
  return ellipsoid.radii.cwiseProduct(scaled.stableNormalized());
}

Vector3d core_support(const Polytope& polytope, const Vector3d& n) {
  return *std::ranges::max_element(polytope.vertices, {},
                                   [&](const Vector3d& v) { return n.dot(v); });
}

double radius_of(const Sphere& s) { return s.radius; }
double radius_of(const Polytope& s) { return s.radius; }
double radius_of(const Capsule& s) { return s.radius; }
template <class S>
double radius_of(const S&) {
  return 0.0;
}

// On curved cores GJK converges by a fraction per step; on polytopes it terminates.
template <class S>
constexpr double kTolerance = 1e-9;
template <>
constexpr double kTolerance<Cylinder> = 1e-7;
template <>
constexpr double kTolerance<Ellipsoid> = 1e-7;

// Largest difference (m) between the distance of GJK's points and the separation along them; above
// it GJK has stopped too early: see settle(). Points whose distance exceeds the separation along
// them by e can be sqrt(2 e distance) from the nearest.
template <class S>
constexpr double kMaxDiscrepancy = 10.0 * kTolerance<S>;

// s(n) of the header, for the whole shape.
template <class S>
double separation_along(Points points, const S& shape, const Vector3d& n) {
  return n.dot(points[points.lowest(n)]) - n.dot(core_support(shape, n)) - radius_of(shape);
}

// --- GJK ---

struct Nearest {
  // Distance between the cores, m; at most kTouching if they touch or overlap.
  double distance = 0.0;
  double separation = 0.0;  // Separation s(n) of the whole shape, with its radius, m.
  Vector3d n = Vector3d::UnitZ();
  Vector3d on_solid = Vector3d::Zero();
};

// Gilbert, Johnson and Keerthi 1988, with Wolfe's corral for the nearest point of the simplex. It
// stops as soon as some direction separates by `cutoff`, because larger distances are not needed.
template <class S>
Nearest gjk(Points points, const Vector3d& shift, const S& shape, double cutoff) {
  const auto difference = [&](const Vector3d& n, std::size_t& index) -> Vector3d {
    index = points.lowest(n);
    return points[index] + shift - core_support(shape, n);
  };
  const double enough = cutoff + radius_of(shape);
  std::size_t index = 0;
  Vector3d v = points.middle() + shift;  // from the middle of the obstacle
  if (v.squaredNorm() == 0.0) v = Vector3d::UnitX();
  v = difference(v, index);
  Corral corral(v, index);
  Nearest nearest;
  for (int iteration = 0;; ++iteration) {
    nearest.distance = v.norm();
    if (nearest.distance <= kTouching) break;
    nearest.n = v / nearest.distance;
    const Vector3d w = difference(nearest.n, index);
    const double along = nearest.n.dot(w);
    nearest.separation = along - radius_of(shape);
    if (along >= enough || nearest.distance - along <= kTolerance<S>) break;
    if (iteration == kMaxIterations || corral.full()) break;
    corral.add(w, index);
    if (!corral.settle()) break;
    const Vector3d next = corral.point();
    if (next.squaredNorm() >= v.squaredNorm()) break;
    v = next;
  }
  for (Eigen::Index i = 0; i < corral.size(); ++i) {
    nearest.on_solid += corral.weight(i) * points[corral.index(i)];
  }
  return nearest;
}

// --- Overlap ---

// The 26 directions to the faces, edges and corners of a cube.
std::array<Vector3d, 26> make_compass() {
  std::array<Vector3d, 26> compass;
  std::size_t count = 0;
  for (const double z : {-1.0, 0.0, 1.0}) {
    for (const double y : {-1.0, 0.0, 1.0}) {
      for (const double x : {-1.0, 0.0, 1.0}) {
        const Vector3d v(x, y, z);
        if (!v.isZero()) compass[count++] = v.normalized();
      }
    }
  }
  return compass;
}

struct Direction {
  double separation = -kInfinity;
  Vector3d n = Vector3d::UnitZ();
  Vector3d on_solid = Vector3d::Zero();
};

// Shifts the solid along n until it is clear of the obstacle, and takes the direction between the
// nearest points there as the next n. s(n) never falls: separated by kParted along n, the distance
// is at least that, and moving back costs at most the shift. It stops at a local maximum of s.
template <class S>
Direction climb(Points points, const S& shape, Direction best) {
  for (int step = 0; step < 8; ++step) {
    const Vector3d shift = std::max(kParted - best.separation, kNudge) * best.n;
    const Nearest nearest = gjk(points, shift, shape, kInfinity);
    if (nearest.distance <= kTouching) break;
    const double separation = separation_along(points, shape, nearest.n);
    if (!(separation > best.separation + 1e-9)) break;  // also stops at NaN
    best = {separation, nearest.n, nearest.on_solid};
  }
  return best;
}

// The compass gives the two best directions to climb from, not both near the same maximum.
template <class S>
Direction part(Points points, const S& shape) {
  static const std::array<Vector3d, 26> kCompass = make_compass();
  Direction first;
  Direction second;
  for (const Vector3d& n : kCompass) {
    const Direction here{separation_along(points, shape, n), n, points[points.lowest(n)]};
    if (here.separation > first.separation) {
      second = std::exchange(first, here);
    } else if (here.separation > second.separation) {
      second = here;
    }
  }
  const Direction a = climb(points, shape, first);
  const Direction b = climb(points, shape, second);
  return a.separation >= b.separation ? a : b;
}

// Rounding may end the search early, with points whose distance exceeds the separation along their
// direction. A shift of a micrometre out of alignment solves this; climb() is the last resort.
template <class S>
Direction settle(Points points, const S& shape, Direction best) {
  const Vector3d nudge = 1e-6 * Vector3d(0.48, 0.35, 0.80);
  const Nearest nudged = gjk(points, nudge, shape, kInfinity);
  if (nudged.distance > kTouching) {
    const double separation = separation_along(points, shape, nudged.n);
    if (separation > best.separation) best = {separation, nudged.n, nudged.on_solid};
    if (nudged.distance - radius_of(shape) - separation < kMaxDiscrepancy<S>) return best;
  }
  return climb(points, shape, best);
}

template <class S>
void solve(Points points, const S& shape, double cutoff, Separation& result) {
  const Nearest nearest = gjk(points, Vector3d::Zero(), shape, cutoff);
  Direction direction;
  if (nearest.distance > kTouching && !std::isnan(nearest.separation)) {
    direction = {nearest.separation, nearest.n, nearest.on_solid};
    if (direction.separation < cutoff &&
        nearest.distance - radius_of(shape) - direction.separation > kMaxDiscrepancy<S>) {
      direction = settle(points, shape, direction);
    }
  } else {
    direction = part(points, shape);
  }
  result.distance = direction.separation;
  result.normal = direction.n;
  result.on_solid = direction.on_solid;
  result.on_obstacle = result.on_solid - result.distance * result.normal;
}

// Far below the remaining error of GJK on a cylinder.
constexpr double kMaxPipeDiscrepancy = 1e-8;

// Most pipes are passed at the side and not over an end. The nearest points are then those of the
// axis, shifted by the radius, and GJK on a segment ends in a few exact steps.
void solve_pipe(Points points, const Cylinder& cylinder, double cutoff, Separation& result) {
  // The capsule contains the cylinder, so its distance is a lower bound.
  const Capsule core{cylinder.radius, cylinder.length};
  const Nearest nearest = gjk(points, Vector3d::Zero(), core, cutoff);
  if (nearest.distance > kTouching) {
    result.normal = nearest.n;
    result.distance = separation_along(points, cylinder, nearest.n);
    result.on_solid = nearest.on_solid;
    result.on_obstacle = result.on_solid - result.distance * result.normal;
    const bool is_exact =
        std::abs(nearest.distance - cylinder.radius - result.distance) < kMaxPipeDiscrepancy;
    if (is_exact || nearest.separation >= cutoff) return;
  }
  solve(points, cylinder, cutoff, result);
}

void solve(Points points, const HalfSpace& half_space, Separation& result) {
  result.normal = half_space.normal;
  result.on_solid = points[points.lowest(half_space.normal)];
  result.distance = half_space.normal.dot(result.on_solid);
  if (std::isnan(result.distance)) result.distance = -kInfinity;
  result.on_obstacle = result.on_solid - result.distance * result.normal;
}

// --- Boxes ---

// The most frequent case, walls and floors: a vertex lies straight over the nearest face. The plane
// of the face then separates the bodies, and the vertex is as near as the plane: exact without GJK.
bool over_face(Points points, const Vector3d& half, const Vector3d& beyond, bool above,
               Eigen::Index axis, Separation& result) {
  const Vector3d normal = (above ? 1.0 : -1.0) * Vector3d::Unit(axis);
  const Vector3d vertex = points[points.lowest(normal)];
  Vector3d outside = vertex.cwiseAbs() - half;
  outside[axis] = 0.0;
  if ((outside.array() > 0.0).any()) return false;
  result.normal = normal;
  result.distance = beyond[axis];
  result.on_solid = vertex;
  result.on_obstacle = vertex - result.distance * normal;
  return true;
}

}  // namespace

NarrowPhase::NarrowPhase(const Shape& shape) : shape_(shape), half_(half_extents(shape)) {}

bool NarrowPhase::separation(const SolidPoints& points_O, double cutoff, Separation& result) const {
  if (const auto* half_space = std::get_if<HalfSpace>(&shape_)) {
    solve(points_O, *half_space, result);
    return result.distance < cutoff;
  }
  const Vector3d low = points_O.low();
  const Vector3d high = points_O.high();
  const Vector3d above = low - half_;
  const Vector3d below = -high - half_;
  const Vector3d beyond = above.cwiseMax(below);
  const double boxes_apart = beyond.cwiseMax(0.0).norm();
  if (boxes_apart > 0.0 && boxes_apart >= cutoff) return false;

  Eigen::Index axis = 0;
  const bool apart = beyond.maxCoeff(&axis) > 0.0;
  if (apart && std::holds_alternative<Box>(shape_) &&
      over_face(points_O, half_, beyond, above[axis] > below[axis], axis, result)) {
    return result.distance < cutoff;
  }
  if (const auto* cylinder = std::get_if<Cylinder>(&shape_)) {
    solve_pipe(points_O, *cylinder, cutoff, result);
  } else {
    std::visit(
        [&](const auto& shape) {
          if constexpr (!std::is_same_v<std::decay_t<decltype(shape)>, HalfSpace>) {
            solve(points_O, shape, cutoff, result);
          }
        },
        shape_);
  }
  return result.distance < cutoff;
}

}  // namespace dive::planning
