#include "planning/world/narrowphase.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fcl/narrowphase/detail/convexity_based_algorithm/gjk_libccd.h>

#include "planning/world/primitives.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using Points = const SolidPoints&;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Below this gap (m) the two nearest points no longer tell a direction.
constexpr double kTouching = 1e-6;
// Overlapping bodies are asked apart by this much (m); see climb().
constexpr double kParted = 0.1;
constexpr double kNudge = 1e-3;  // And apart ones are moved by this much.
constexpr int kMaxIterations = 100;

// --- Support functions: the farthest point along n, of any length but not zero. ---
// Rounded shapes are given to GJK as their core (a point, a segment) and a radius to subtract:
// exact, and most overlaps become plain distances between cores.

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

// GJK on curved cores converges a fraction at a time, on polytopes it ends by itself.
template <class S>
constexpr double kTolerance = 1e-9;
template <>
constexpr double kTolerance<Cylinder> = 1e-7;
template <>
constexpr double kTolerance<Ellipsoid> = 1e-7;

// Above this difference (m) between the distance of FCL's points and the separation along them one
// of the two is wrong: see solve(). Points that are e farther apart than their direction separates
// can be sqrt(2 e distance) from the nearest.
template <class S>
constexpr double kDoubt = 10.0 * kTolerance<S>;

// s(n) of the header, for the whole shape.
template <class S>
double separation_along(Points points, const S& shape, const Vector3d& n) {
  return n.dot(points[points.lowest(n)]) - n.dot(core_support(shape, n)) - radius_of(shape);
}

// --- FCL ---

struct ShiftedPoints {
  Points points;
  Vector3d shift;
};

Vector3d from_ccd(const ccd_vec3_t& v) { return {v.v[0], v.v[1], v.v[2]}; }
void to_ccd(const Vector3d& v, ccd_vec3_t* out) { ccdVec3Set(out, v.x(), v.y(), v.z()); }

void points_support(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* out) {
  const auto& solid = *static_cast<const ShiftedPoints*>(object);
  to_ccd(solid.points[solid.points.lowest(-from_ccd(*direction))] + solid.shift, out);
}

template <class S>
void shape_support(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* out) {
  to_ccd(core_support(*static_cast<const S*>(object), from_ccd(*direction)), out);
}

struct Nearest {
  double distance = 0.0;  // Between the cores; not above kTouching when they touch or overlap.
  Vector3d on_solid;
  Vector3d on_core;
};

template <class S>
Nearest gjk(Points points, const Vector3d& shift, const S& shape) {
  const ShiftedPoints solid{points, shift};
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = &points_support;
  ccd.support2 = &shape_support<S>;
  ccd.max_iterations = kMaxIterations;
  ccd.dist_tolerance = kTolerance<S>;
  ccd_vec3_t on_solid{};
  ccd_vec3_t on_core{};
  fcl::detail::libccd_extension::ccdGJKDist2(&solid, &shape, &ccd, &on_solid, &on_core);
  Nearest nearest{0.0, from_ccd(on_solid), from_ccd(on_core)};
  nearest.distance = (nearest.on_solid - nearest.on_core).norm();  // 0 when FCL found an overlap.
  return nearest;
}

// --- Overlap ---

// The 26 directions to the faces, edges and corners of a cube.
std::array<Vector3d, 26> make_compass() {
  std::array<Vector3d, 26> compass;
  std::size_t count = 0;
  for (int code = 0; code < 27; ++code) {
    const Vector3d v(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
    if (code != 13) compass[count++] = v.normalized();
  }
  return compass;
}

struct Direction {
  double separation = -kInfinity;
  Vector3d n = Vector3d::UnitZ();
  Vector3d on_solid = Vector3d::Zero();
};

// Shifts the solid along n until it is clear of the obstacle, and takes the direction between the
// nearest points there as the next n. s(n) never falls: apart by kParted along n, the distance is
// at least that, and moving back costs at most the shift. It stops at a local maximum of s.
template <class S>
Direction climb(Points points, const S& shape, Direction best) {
  for (int step = 0; step < 8; ++step) {
    const Vector3d shift = std::max(kParted - best.separation, kNudge) * best.n;
    const Nearest nearest = gjk(points, shift, shape);
    if (nearest.distance <= kTouching) break;
    const Vector3d n = (nearest.on_solid - nearest.on_core) / nearest.distance;
    const double separation = separation_along(points, shape, n);
    if (separation <= best.separation + 1e-9) break;
    best = {separation, n, nearest.on_solid - shift};
  }
  return best;
}

// The compass finds the two best directions to climb from, not both on one side of the same hill.
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

// Of parallel boxes and the like FCL's GJK may return points that are not the nearest, by a metre
// in one in a hundred placements on a lattice. Then they are farther apart than their direction
// separates. A push of a micrometre off the lattice settles it; climb() is the last resort.
template <class S>
Direction settle(Points points, const S& shape, Direction best) {
  const Vector3d nudge = 1e-6 * Vector3d(0.48, 0.35, 0.80);
  const Nearest nudged = gjk(points, nudge, shape);
  if (nudged.distance > kTouching) {
    const Vector3d n = (nudged.on_solid - nudged.on_core) / nudged.distance;
    const double separation = separation_along(points, shape, n);
    if (separation > best.separation) best = {separation, n, nudged.on_solid - nudge};
    if (nudged.distance - radius_of(shape) - separation < kDoubt<S>) return best;
  }
  return climb(points, shape, best);
}

template <class S>
void solve(Points points, const S& shape, Separation& result) {
  const Nearest nearest = gjk(points, Vector3d::Zero(), shape);
  Direction direction;
  if (nearest.distance > kTouching) {
    const Vector3d n = (nearest.on_solid - nearest.on_core) / nearest.distance;
    direction = {separation_along(points, shape, n), n, nearest.on_solid};
    if (nearest.distance - radius_of(shape) - direction.separation > kDoubt<S>) {
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

// Far below what a cylinder's own GJK would leave.
constexpr double kPipeDoubt = 1e-8;

// Most pipes are passed beside and not over an end: then the nearest points are those of the axis
// but for the radius, and GJK on a segment ends in a few exact steps.
void solve_pipe(Points points, const Cylinder& cylinder, Separation& result) {
  const Capsule core{cylinder.radius, cylinder.length};
  const Nearest nearest = gjk(points, Vector3d::Zero(), core);
  if (nearest.distance > kTouching) {
    result.normal = (nearest.on_solid - nearest.on_core) / nearest.distance;
    result.distance = separation_along(points, cylinder, result.normal);
    result.on_solid = nearest.on_solid;
    result.on_obstacle = result.on_solid - result.distance * result.normal;
    if (std::abs(nearest.distance - cylinder.radius - result.distance) < kPipeDoubt) return;
  }
  solve(points, cylinder, result);
}

void solve(Points points, const HalfSpace& half_space, Separation& result) {
  result.normal = half_space.normal;
  result.on_solid = points[points.lowest(half_space.normal)];
  result.distance = half_space.normal.dot(result.on_solid);
  result.on_obstacle = result.on_solid - result.distance * result.normal;
}

// --- Boxes ---

// The commonest case, walls and floors: a vertex lies straight over the nearest face. Then the
// plane of the face parts the bodies and the vertex is as near as the plane: exact without GJK.
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
    solve_pipe(points_O, *cylinder, result);
  } else {
    std::visit([&](const auto& shape) { solve(points_O, shape, result); }, shape_);
  }
  return result.distance < cutoff;
}

}  // namespace dive::planning
