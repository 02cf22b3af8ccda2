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

// Plan view of the part of a box with low <= z <= high, as points whose convex hull it is.
void footprint(const Obstacle& box, double low, double high, std::vector<Vector2d>& points) {
  const std::array<Vector3d, 8> corner = corners(box);
  points.clear();
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
}

// Convex hull of sorted points, counter-clockwise, by Andrew's monotone chain.
void convex_hull(std::vector<Vector2d>& points, std::vector<Vector2d>& hull) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  hull.clear();
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = hull.size();
    for (const Vector2d& p : points) {
      while (hull.size() >= start + 2 &&
             cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0.0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();  // First point of the other pass.
    std::reverse(points.begin(), points.end());
  }
}

// Plan view of any polytope: the edges of its hull are among the lines between its vertices, and
// the other lines lie inside it.
void footprint(const Polytope& polytope, const Pose& X_WO, double low, double high,
               std::vector<Vector2d>& points) {
  points.clear();
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
}

std::vector<Eigen::AlignedBox3d> boxes_of(const World& world) {
  std::vector<Eigen::AlignedBox3d> boxes;
  boxes.reserve(world.obstacles.size());
  for (const Obstacle& obstacle : world.obstacles) boxes.push_back(bounding_box(obstacle));
  return boxes;
}

// Largest number of points in its footprint, plus two for the hull under construction.
std::size_t largest_footprint(const Obstacle& obstacle) {
  const auto* polytope = std::get_if<Polytope>(&obstacle.shape);
  const std::size_t count = polytope != nullptr ? polytope->vertices.size() : 8;
  return count + count * count / 2 + 2;
}

double distance_to_segment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d ab = b - a;
  const double squared = ab.squaredNorm();
  const double t = squared > 0.0 ? std::clamp((p - a).dot(ab) / squared, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

bool within(PlanView& view, const Vector2d& p, double radius) {
  if (view.points.size() < 2) return !view.points.empty() && (view.points[0] - p).norm() < radius;
  convex_hull(view.points, view.hull);
  const std::vector<Vector2d>& hull = view.hull;
  bool inside = hull.size() > 2;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vector2d& a = hull[i];
    const Vector2d& b = hull[(i + 1) % hull.size()];
    if (distance_to_segment(p, a, b) < radius) return true;
    inside = inside && cross(b - a, p - a) > 0.0;
  }
  return inside;
}

// Uses the least n . x over the tube: at its nearer end, on the side that faces the solid.
bool half_space_above(const Obstacle& obstacle, const Vector3d& p_W, double radius) {
  const Vector3d n_W = obstacle.X_WO.q * std::get<HalfSpace>(obstacle.shape).normal;
  const double at_p = n_W.dot(p_W - obstacle.X_WO.p);
  const double climb = n_W.z() * -p_W.z();
  return at_p + std::min(climb, 0.0) - radius * n_W.head<2>().norm() < 0.0;
}

}  // namespace

bool is_above(const Obstacle& obstacle, const Vector3d& p_W, double radius, PlanView& scratch) {
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
    footprint(*polytope, obstacle.X_WO, p_W.z() - r, r, scratch.points);
    return within(scratch, p_W.head<2>(), radius + r);
  }
  footprint(obstacle, p_W.z(), 0.0, scratch.points);
  return within(scratch, p_W.head<2>(), radius);
}

OverheadIndex::OverheadIndex(const World& world) : world_(&world), tree_(boxes_of(world)) {
  std::size_t largest = 0;
  for (const Obstacle& obstacle : world.obstacles) {
    largest = std::max(largest, largest_footprint(obstacle));
  }
  scratch_.points.reserve(largest);
  scratch_.hull.reserve(largest);
}

bool OverheadIndex::is_above(const Vector3d& p_W, double radius) {
  const Vector3d reach(radius, radius, 0.0);
  const Vector3d top(p_W.x(), p_W.y(), std::max(p_W.z(), 0.0));
  const Eigen::AlignedBox3d tube(p_W - reach, top + reach);
  bool found = false;
  tree_.visit(tube, 0.0, [&](std::size_t index) {
    found = planning::is_above(world_->obstacles[index], p_W, radius, scratch_);
    return found ? -1.0 : 0.0;
  });
  return found;
}

}  // namespace dive::planning
