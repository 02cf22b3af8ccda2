#include "mission/drawing/svg_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

namespace dive::mission {
namespace {

using planning::Box;
using planning::Capsule;
using planning::Cylinder;
using planning::Ellipsoid;
using planning::HalfSpace;
using planning::Sphere;

constexpr double kMaxCoordinate = 1e5;  // m

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// The point of a shape that is farthest in a given direction, in the shape's frame.
struct Support {
  Eigen::Vector3d d;

  [[nodiscard]] static double sign(double value) { return value < 0.0 ? -1.0 : 1.0; }

  Eigen::Vector3d operator()(const Box& box) const {
    return 0.5 * box.size.cwiseProduct(Eigen::Vector3d(sign(d.x()), sign(d.y()), sign(d.z())));
  }
  Eigen::Vector3d operator()(const Cylinder& cylinder) const {
    const double across = std::max(std::hypot(d.x(), d.y()), 1e-12);
    return {cylinder.radius * d.x() / across, cylinder.radius * d.y() / across,
            0.5 * cylinder.length * sign(d.z())};
  }
  Eigen::Vector3d operator()(const Sphere& sphere) const { return sphere.radius * d; }
  Eigen::Vector3d operator()(const Capsule& capsule) const {
    return capsule.radius * d + Eigen::Vector3d(0.0, 0.0, 0.5 * capsule.length * sign(d.z()));
  }
  Eigen::Vector3d operator()(const Ellipsoid& ellipsoid) const {
    const Eigen::Vector3d stretched = ellipsoid.radii.cwiseProduct(d);
    return ellipsoid.radii.cwiseProduct(stretched) / std::max(stretched.norm(), 1e-12);
  }
  Eigen::Vector3d operator()(const HalfSpace&) const { return Eigen::Vector3d::Zero(); }
  Eigen::Vector3d operator()(const planning::Polytope& polytope) const {
    const auto farthest = std::ranges::max_element(
        polytope.vertices, {}, [this](const Eigen::Vector3d& v) { return d.dot(v); });
    return *farthest + polytope.radius * d;
  }
};

Eigen::Vector3d support(const planning::Obstacle& obstacle, const Eigen::Vector3d& direction_W) {
  const Eigen::Vector3d d = obstacle.X_WO.q.conjugate() * direction_W;
  return obstacle.X_WO * std::visit(Support{d}, obstacle.shape);
}

Points2 bounded_outline(const planning::Obstacle& obstacle, const Projection& view) {
  Points2 points;
  if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d d((i & 1) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 1.0 : -1.0,
                              (i & 4) != 0 ? 1.0 : -1.0);
      points.push_back(view(obstacle.X_WO * Support{d}(*box)));
    }
    return hull_of(std::move(points));
  }
  if (const auto* polytope = std::get_if<planning::Polytope>(&obstacle.shape)) {
    for (const Eigen::Vector3d& v : polytope->vertices) points.push_back(view(obstacle.X_WO * v));
    return hull_of(std::move(points));
  }
  constexpr int kDirections = 96;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * std::numbers::pi * (i + 0.5) / kDirections;
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    direction[view.u] = std::cos(angle);
    direction[view.v] = std::sin(angle);
    points.push_back(view(support(obstacle, direction)));
  }
  return hull_of(std::move(points));
}

// A half-space viewed edge-on is drawn as its part of the region; in other views it would cover
// everything and is omitted.
Points2 half_space_outline(const planning::Obstacle& obstacle, const Projection& view,
                           const Eigen::AlignedBox3d& region) {
  const Eigen::Vector3d normal = obstacle.X_WO.q * std::get<HalfSpace>(obstacle.shape).normal;
  if (std::abs(normal[view.depth]) > 1e-3) return {};
  const Eigen::Vector2d n = view(normal);
  const double offset = n.dot(view(obstacle.X_WO.p));
  const Eigen::Vector2d low = view(region.min());
  const Eigen::Vector2d high = view(region.max());
  const Points2 corners{low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  Points2 inside;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d& b = corners[(i + 1) % corners.size()];
    const double at_a = n.dot(a) - offset;
    const double at_b = n.dot(b) - offset;
    if (at_a <= 0.0) inside.push_back(a);
    if ((at_a <= 0.0) != (at_b <= 0.0)) inside.push_back(a + (b - a) * (at_a / (at_a - at_b)));
  }
  return inside;
}

bool inside(const Points2& convex, const Eigen::Vector2d& p) {
  for (std::size_t i = 0; i < convex.size(); ++i) {
    const Eigen::Vector2d& a = convex[i];
    if (cross(convex[(i + 1) % convex.size()] - a, p - a) < 0.0) return false;
  }
  return convex.size() >= 3;
}

Standing standing_of(const planning::Obstacle& obstacle, const Points2& corners,
                     const Projection& view, const std::vector<Eigen::Vector3d>& paths) {
  Eigen::Vector3d toward_viewer = Eigen::Vector3d::Zero();
  toward_viewer[view.depth] = view.toward;
  const double front = toward_viewer.dot(support(obstacle, toward_viewer));
  const double back = toward_viewer.dot(support(obstacle, -toward_viewer));
  if (paths.empty()) return Standing::kBehind;  // a map alone: translucent, to show all obstacles
  bool passed_in_front = false;
  for (const Eigen::Vector3d& p : paths) {
    if (!inside(corners, view(p))) continue;
    const double nearness = toward_viewer.dot(p);
    if (back >= nearness) return Standing::kInFront;
    passed_in_front = passed_in_front || nearness >= front;
  }
  return passed_in_front ? Standing::kBehind : Standing::kBeside;
}

bool drawable(const planning::Obstacle& obstacle) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      if (!dive::mission::drawable(support(obstacle, side * Eigen::Vector3d::Unit(axis)))) {
        return false;
      }
    }
  }
  return true;
}

Eigen::AlignedBox3d bounds_of(const planning::Obstacle& obstacle) {
  Eigen::AlignedBox3d bounds;
  for (int axis = 0; axis < 3; ++axis) {
    bounds.extend(support(obstacle, Eigen::Vector3d::Unit(axis)));
    bounds.extend(support(obstacle, -Eigen::Vector3d::Unit(axis)));
  }
  return bounds;
}

// Extends the region to those ends of an obstacle that are near.
void show_ends(const Eigen::AlignedBox3d& obstacle, double near, Eigen::AlignedBox3d& region) {
  for (int axis = 0; axis < 3; ++axis) {
    const double below = region.min()[axis] - obstacle.min()[axis];
    const double above = obstacle.max()[axis] - region.max()[axis];
    if (below > 0.0 && below < near) region.min()[axis] = obstacle.min()[axis];
    if (above > 0.0 && above < near) region.max()[axis] = obstacle.max()[axis];
  }
}

}  // namespace

bool drawable(const Eigen::Vector3d& p) {
  return p.allFinite() && p.cwiseAbs().maxCoeff() < kMaxCoordinate;
}

Points2 hull_of(Points2 points) {
  const auto less = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  };
  std::sort(points.begin(), points.end(), less);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  // Andrew's monotone chain: the lower half from left to right, the upper half back.
  Points2 hull;
  const auto add = [&hull](const Eigen::Vector2d& p, std::size_t keep) {
    while (hull.size() >= keep + 2 &&
           cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0.0) {
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const Eigen::Vector2d& p : points) add(p, 0);
  const std::size_t lower = hull.size() - 1;
  for (auto p = points.rbegin() + 1; p != points.rend(); ++p) add(*p, lower);
  hull.pop_back();
  return hull;
}

std::vector<Eigen::Vector3d> path_samples(const DiveDrawing& drawing) {
  constexpr int kPerLeg = 16;
  constexpr std::size_t kSwumSamples = 2000;
  std::vector<Eigen::Vector3d> samples;
  const auto keep = [&samples](const Eigen::Vector3d& p) {
    if (drawable(p)) samples.push_back(p);
  };
  for (const PlannedLeg& leg : drawing.legs) {
    for (std::size_t i = 0; i < leg.waypoints.size(); ++i) {
      keep(leg.waypoints[i].p);
      for (int k = 1; i > 0 && k < kPerLeg; ++k) {
        const Eigen::Vector3d& from = leg.waypoints[i - 1].p;
        keep(from + (leg.waypoints[i].p - from) * (static_cast<double>(k) / kPerLeg));
      }
    }
  }
  const std::size_t stride = std::max<std::size_t>(1, drawing.swum.size() / kSwumSamples);
  for (std::size_t i = 0; i < drawing.swum.size(); i += stride) keep(drawing.swum[i]);
  return samples;
}

Eigen::AlignedBox3d region_of_interest(const DiveDrawing& drawing) {
  Eigen::AlignedBox3d region;
  const auto include = [&region](const Eigen::Vector3d& p) {
    if (drawable(p)) region.extend(p);
  };
  for (const PlannedLeg& leg : drawing.legs) {
    for (const Pose& pose : leg.waypoints) include(pose.p);
  }
  for (const auto& [name, p] : drawing.goals) include(p);
  for (const Eigen::Vector3d& p : drawing.swum) include(p);
  for (const Eigen::Vector3d& p : drawing.estimated) include(p);

  std::vector<Eigen::AlignedBox3d> obstacles;
  if (drawing.world != nullptr) {
    for (const planning::Obstacle& obstacle : drawing.world->obstacles) {
      if (std::holds_alternative<HalfSpace>(obstacle.shape)) include(obstacle.X_WO.p);
      if (std::holds_alternative<HalfSpace>(obstacle.shape) || !drawable(obstacle)) continue;
      obstacles.push_back(bounds_of(obstacle));
    }
  }
  const bool has_paths = !region.isEmpty();
  for (const Eigen::AlignedBox3d& obstacle : obstacles) {
    if (!has_paths) region.extend(obstacle);
  }
  if (region.isEmpty()) {
    region.extend(Eigen::Vector3d(-5.0, -3.0, -5.0));
    region.extend(Eigen::Vector3d(5.0, 3.0, 0.0));
  }
  const double span = std::max(region.sizes().maxCoeff(), 5.0);
  const Eigen::Vector3d margin =
      Eigen::Vector3d::Constant(std::max(1.5 * drawing.clearance_required_m, 0.04 * span) + 0.5);
  region = Eigen::AlignedBox3d(region.min() - margin, region.max() + margin);
  const Eigen::Vector3d nearby = Eigen::Vector3d::Constant(0.1 * span);
  const Eigen::AlignedBox3d around(region.min() - nearby, region.max() + nearby);
  for (const Eigen::AlignedBox3d& obstacle : obstacles) {
    if (around.intersects(obstacle)) show_ends(obstacle, 0.3 * span, region);
  }
  // The surface is drawn unless it is far above, with little of the air above it.
  if (region.max().z() > -span) region.max().z() = std::max(region.max().z(), 0.04 * span);
  region.max().z() = std::min(region.max().z(), std::max(0.06 * span, region.min().z() + 1.0));
  const Eigen::Vector3d rim = Eigen::Vector3d(0.02, 0.02, 0.0) * span;
  return {region.min() - rim, region.max() + rim};
}

Outline outline_of(const planning::Obstacle& obstacle, const Projection& view,
                   const std::vector<Eigen::Vector3d>& paths, const Eigen::AlignedBox3d& region) {
  if (std::holds_alternative<HalfSpace>(obstacle.shape)) {
    return {half_space_outline(obstacle, view, region), Standing::kBeside};
  }
  if (!drawable(obstacle)) return {};
  Outline outline{bounded_outline(obstacle, view), Standing::kBeside};
  outline.standing = standing_of(obstacle, outline.corners, view, paths);
  return outline;
}

std::vector<Points2> sweep_of(const std::vector<Pose>& waypoints, const planning::RobotHull& hull,
                              const Projection& view) {
  // rad: within this turn the hull of two poses hardly differs from the swept hull
  constexpr double kTurnPerStep = 0.1;
  std::vector<Points2> polygons;
  const auto add_hull = [&](const Pose& X_WB, Points2& points) {
    for (const planning::ConvexSolid& part : hull.parts) {
      for (const Eigen::Vector3d& vertex : part.vertices) points.push_back(view(X_WB * vertex));
    }
  };
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    const Pose& from = waypoints[i - 1];
    const Pose& to = waypoints[i];
    if (!drawable(from.p) || !drawable(to.p) || !from.is_finite() || !to.is_finite()) continue;
    const int steps = 1 + static_cast<int>(angle_between(from.q, to.q) / kTurnPerStep);
    for (int k = 0; k < steps; ++k) {
      Points2 points;
      add_hull(interpolate(from, to, static_cast<double>(k) / steps), points);
      add_hull(interpolate(from, to, static_cast<double>(k + 1) / steps), points);
      polygons.push_back(hull_of(std::move(points)));
    }
  }
  return polygons;
}

}  // namespace dive::mission
