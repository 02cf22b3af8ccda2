#include "planning/world/overhead.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "planning/world/primitives.h"

namespace dive::planning {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Corner i of a box has the sign of axis k in bit k; an edge joins corners that differ in one bit.
std::array<Vector3d, 8> corners(const Obstacle& box) {
  const Vector3d half = half_extents(box.shape);
  std::array<Vector3d, 8> result;
  for (unsigned i = 0; i < 8; ++i) {
    const Vector3d sign((i & 1U) ? 1.0 : -1.0, (i & 2U) ? 1.0 : -1.0, (i & 4U) ? 1.0 : -1.0);
    result[i] = box.X_WO * half.cwiseProduct(sign);
  }
  return result;
}

// Plan view of the part of a box with low <= z <= high: points whose convex hull it is.
std::vector<Vector2d> footprint(const Obstacle& box, double low, double high) {
  const std::array<Vector3d, 8> corner = corners(box);
  std::vector<Vector2d> points;
  for (unsigned i = 0; i < 8; ++i) {
    if (corner[i].z() >= low && corner[i].z() <= high) points.emplace_back(corner[i].head<2>());
    for (unsigned axis = 1; axis < 8; axis <<= 1U) {
      if ((i & axis) != 0U) continue;
      const Vector3d& a = corner[i];
      const Vector3d& b = corner[i | axis];
      for (const double z : {low, high}) {
        if ((a.z() - z) * (b.z() - z) >= 0.0) continue;
        const double t = (z - a.z()) / (b.z() - a.z());
        points.emplace_back((a + t * (b - a)).head<2>());
      }
    }
  }
  return points;
}

// Convex hull, counter-clockwise, by Andrew's monotone chain.
std::vector<Vector2d> convex_hull(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Vector2d> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = hull.size();
    for (const Vector2d& p : points) {
      while (hull.size() >= start + 2 &&
             cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0.0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();  // The first point of the other pass.
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

// The same of any polytope: the edges of its hull are among the lines between its vertices, and the
// others lie inside it.
std::vector<Vector2d> footprint(const Polytope& polytope, const Pose& X_WO, double low,
                                double high) {
  std::vector<Vector2d> points;
  for (const Vector3d& v : polytope.vertices) {
    const Vector3d a = X_WO * v;
    if (a.z() >= low && a.z() <= high) points.emplace_back(a.head<2>());
    for (const Vector3d& w : polytope.vertices) {
      const Vector3d b = X_WO * w;
      for (const double z : {low, high}) {
        if (!(a.z() < z && b.z() > z)) continue;
        const double t = (z - a.z()) / (b.z() - a.z());
        points.emplace_back((a + t * (b - a)).head<2>());
      }
    }
  }
  return points;
}

double distance_to_segment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d ab = b - a;
  const double squared = ab.squaredNorm();
  const double t = squared > 0.0 ? std::clamp((p - a).dot(ab) / squared, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

bool within(const std::vector<Vector2d>& points, const Vector2d& p, double radius) {
  if (points.size() < 2) return !points.empty() && (points[0] - p).norm() < radius;
  const std::vector<Vector2d> hull = convex_hull(points);
  bool inside = hull.size() > 2;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vector2d& a = hull[i];
    const Vector2d& b = hull[(i + 1) % hull.size()];
    if (distance_to_segment(p, a, b) < radius) return true;
    inside = inside && cross(b - a, p - a) > 0.0;
  }
  return inside;
}

// Least n . x over the tube: at its nearer end, on the side that faces the solid.
bool half_space_above(const Obstacle& obstacle, const Vector3d& p_W, double radius) {
  const Vector3d n_W = obstacle.X_WO.q * std::get<HalfSpace>(obstacle.shape).normal;
  const double at_p = n_W.dot(p_W - obstacle.X_WO.p);
  const double climb = n_W.z() * -p_W.z();
  return at_p + std::min(climb, 0.0) - radius * n_W.head<2>().norm() < 0.0;
}

}  // namespace

bool is_above(const Obstacle& obstacle, const Vector3d& p_W, double radius) {
  if (p_W.z() >= 0.0) return false;
  if (std::holds_alternative<HalfSpace>(obstacle.shape)) {
    return half_space_above(obstacle, p_W, radius);
  }
  const Eigen::AlignedBox3d bounds = bounding_box(obstacle);
  if (bounds.max().z() <= p_W.z() || bounds.min().z() >= 0.0) return false;
  const Vector2d gap = (bounds.min() - p_W).cwiseMax(p_W - bounds.max()).cwiseMax(0.0).head<2>();
  if (gap.norm() > radius) return false;
  if (const auto* polytope = std::get_if<Polytope>(&obstacle.shape)) {
    const double r = polytope->radius;
    return within(footprint(*polytope, obstacle.X_WO, p_W.z() - r, r), p_W.head<2>(), radius + r);
  }
  return within(footprint(obstacle, p_W.z(), 0.0), p_W.head<2>(), radius);
}

}  // namespace dive::planning
