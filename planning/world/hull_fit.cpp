#include "planning/world/hull_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "planning/world/nearest_in_hull.h"

namespace dive::planning {
namespace {

using Eigen::AlignedBox2d;
using Eigen::AlignedBox3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSmall = 4.0;               // in tolerances: smaller regions are left to boxes
constexpr double kSliver = 1e-8;             // m: narrower regions result from rounding
constexpr double kSlack = 1e-7;              // m: allowance for them
constexpr std::size_t kMaxCutTriangles = 8;  // limit of triangles by which a region is cut
constexpr double kMinWidth = 1e-3;           // m: least width of a projection worth testing
constexpr double kSupporting = 1e-9;         // m: a plane may cut off this much before it is moved

using Polygon = std::vector<Vector2d>;  // Convex, in the projection.

// k . (u, v, 1): a height over the projection, or one side of a line in it.
using Linear = Vector3d;
double at(const Linear& f, const Vector2d& q) { return f.x() * q.x() + f.y() * q.y() + f.z(); }

double highest(const Linear& f, const Polygon& polygon) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Vector2d& q : polygon) most = std::max(most, at(f, q));
  return most;
}

AlignedBox2d box_of(const Polygon& polygon) {
  AlignedBox2d box;
  for (const Vector2d& q : polygon) box.extend(q);
  return box;
}

// The parts with side <= 0 and side > 0 (Sutherland and Hodgman 1974).
std::pair<Polygon, Polygon> cut(const Polygon& polygon, const Linear& side) {
  std::pair<Polygon, Polygon> parts;
  auto& [inside, outside] = parts;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    const double at_a = at(side, a);
    const double at_b = at(side, b);
    if (at_a <= 0.0) inside.push_back(a);
    if (at_a >= 0.0) outside.push_back(a);
    if (at_a * at_b >= 0.0) continue;
    const Vector2d crossing = a + at_a / (at_a - at_b) * (b - a);
    inside.push_back(crossing);
    outside.push_back(crossing);
  }
  return parts;
}

double area_of(const Polygon& polygon) {
  double twice = 0.0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const Vector2d a = polygon[i] - polygon[0];
    const Vector2d b = polygon[i + 1] - polygon[0];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2.0;
}

bool is_sliver(const Polygon& polygon) {
  if (polygon.size() < 3) return true;
  return area_of(polygon) <= kSliver * box_of(polygon).diagonal().norm();
}

// The line through a and b, negative on the side of c; a unit normal, so that it is a distance.
Linear side_of(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const Vector2d n = Vector2d(b.y() - a.y(), a.x() - b.x()).normalized();
  const Linear line(n.x(), n.y(), -n.dot(a));
  return at(line, c) > 0.0 ? Linear(-line) : line;
}

// Height over the projection of the plane through three points. Absent for a steep one.
std::optional<Linear> plane_through(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d n = (b - a).cross(c - a);
  if (std::abs(n.z()) <= 1e-6 * n.norm() || !(n.norm() > 0.0)) return std::nullopt;
  return Linear(-n.x() / n.z(), -n.y() / n.z(), n.dot(a) / n.z());
}

// A triangle projected along the piece's thinnest axis.
struct ProjectedTriangle {
  std::array<Linear, 3> sides;  // Sides, at most 0 inside.
  Linear height;
  AlignedBox2d box;
};

// Axes of least, medium and greatest spread of the points.
Eigen::Matrix3d principal_axes(const std::vector<Vector3d>& points) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& v : points) mean += v / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& v : points) spread += (v - mean) * (v - mean).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
}

// The planes of the facets that face up (sign 1) or down (-1): all points are below, or above.
std::vector<Linear> envelope(const std::vector<Vector3d>& points, double sign) {
  std::vector<Linear> planes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      for (std::size_t k = j + 1; k < points.size(); ++k) {
        std::optional<Linear> plane = plane_through(points[i], points[j], points[k]);
        if (!plane) continue;
        double most = 0.0;
        for (const Vector3d& p : points) {
          most = std::max(most, sign * (p.z() - at(*plane, p.head<2>())));
        }
        if (most > kSupporting) continue;
        plane->z() += sign * most;
        const bool is_known = std::ranges::any_of(
            planes, [&](const Linear& known) { return (known - *plane).norm() < kSupporting; });
        if (!is_known) planes.push_back(*plane);
      }
    }
  }
  return planes;
}

// The hull of the piece's projected points: the box around them, cut by the lines that have all
// of them on one side.
Polygon plan_of(const std::vector<Vector3d>& points, const AlignedBox3d& box) {
  const Vector2d low = box.min().head<2>();
  const Vector2d high = box.max().head<2>();
  Polygon polygon{low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      const Vector2d a = points[i].head<2>();
      const Vector2d b = points[j].head<2>();
      if ((b - a).norm() < kMinWidth) continue;
      for (const double sign : {1.0, -1.0}) {
        Linear line = sign * side_of(a, b, b + Vector2d(a.y() - b.y(), b.x() - a.x()));
        double most = 0.0;
        for (const Vector3d& p : points) most = std::max(most, at(line, p.head<2>()));
        if (most > kSupporting) continue;
        line.z() -= most;
        polygon = cut(polygon, line).first;
      }
    }
  }
  return polygon;
}

class HullFit {
 public:
  HullFit(const Polytope& piece, const TriangleSoup& soup, double tolerance)
      : vertices_(piece.vertices),
        soup_(soup),
        tolerance_(tolerance),
        reach_(tolerance - piece.radius),
        origin_(piece.vertices.front()) {
    const Eigen::Matrix3d axes = principal_axes(vertices_);
    R_.row(0) = axes.col(2).transpose();
    R_.row(1) = axes.col(1).transpose();
    R_.row(2) = axes.col(0).transpose();
    for (const Vector3d& v : vertices_) {
      points_.push_back(local(v));
      box_.extend(points_.back());
    }
  }

  bool holds() {
    // Most pieces that do not fit fail half way between two corners.
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      for (std::size_t j = i; j < vertices_.size(); ++j) {
        if (!is_near((vertices_[i] + vertices_[j]) / 2.0)) return false;
      }
    }
    if (box_.sizes().y() < kMinWidth) return boxes_fit(box_);
    const std::vector<ProjectedTriangle> triangles = triangles_nearby();
    const double small = kSmall * tolerance_;
    if (static_cast<double>(triangles.size()) * small * small > box_.sizes().head<2>().prod()) {
      return boxes_fit(box_);
    }
    upper_ = envelope(points_, 1.0);
    lower_ = envelope(points_, -1.0);
    if (upper_.empty() || lower_.empty()) return boxes_fit(box_);
    return region_fits(plan_of(points_, box_), triangles);
  }

 private:
  [[nodiscard]] Vector3d local(const Vector3d& p) const { return R_ * (p - origin_); }
  [[nodiscard]] Vector3d global(const Vector3d& p) const { return R_.transpose() * p + origin_; }
  // Margin, so that boxes smaller than it need not be divided.
  [[nodiscard]] double margin() const { return 0.25 * tolerance_; }
  [[nodiscard]] bool is_near(const Vector3d& p) const {
    return soup_.nearest(p, reach_ - margin()).has_value();
  }

  [[nodiscard]] std::vector<ProjectedTriangle> triangles_nearby() const {
    AlignedBox3d around;
    for (const Vector3d& v : vertices_) around.extend(v);
    std::vector<ProjectedTriangle> triangles;
    soup_.visit(around, reach_, [&](std::size_t i) {
      std::array<Vector3d, 3> t = soup_.corners(i);
      for (Vector3d& v : t) v = local(v);
      const std::optional<Linear> height = plane_through(t[0], t[1], t[2]);
      if (!height) return;
      ProjectedTriangle& triangle = triangles.emplace_back();
      triangle.height = *height;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2d a = t[k].head<2>();
        triangle.sides[k] = side_of(a, t[(k + 1) % 3].head<2>(), t[(k + 2) % 3].head<2>());
        triangle.box.extend(a);
      }
    });
    return triangles;
  }

  // True if the part of the piece over the region is near the triangle, which covers the whole
  // region.
  [[nodiscard]] bool is_over(const Polygon& region, const ProjectedTriangle& triangle) const {
    const double reach = reach_ - kSlack;
    return std::ranges::any_of(upper_,
                               [&](const Linear& plane) {
                                 return highest(plane - triangle.height, region) <= reach;
                               }) &&
           std::ranges::any_of(lower_, [&](const Linear& plane) {
             return highest(triangle.height - plane, region) <= reach;
           });
  }

  // The region without the parts proved to be near a triangle.
  [[nodiscard]] std::vector<Polygon> uncovered(
      Polygon region, const std::vector<ProjectedTriangle>& triangles) const {
    std::vector<Polygon> rest{std::move(region)};
    for (const ProjectedTriangle& triangle : triangles) {
      std::vector<Polygon> next;
      for (Polygon& fragment : rest) {
        std::vector<Polygon> outside;
        Polygon inside = fragment;
        for (const Linear& side : triangle.sides) {
          auto [in, out] = cut(inside, side);
          if (!is_sliver(out)) outside.push_back(std::move(out));
          inside = std::move(in);
        }
        if (is_sliver(inside) || !is_over(inside, triangle)) {
          next.push_back(std::move(fragment));
        } else {
          std::ranges::move(outside, std::back_inserter(next));
        }
      }
      rest = std::move(next);
    }
    return rest;
  }

  // Lower and upper height of the hull at one point of its projection.
  [[nodiscard]] std::pair<double, double> heights(const Vector2d& q) const {
    double low = -std::numeric_limits<double>::infinity();
    double high = -low;
    for (const Linear& plane : lower_) low = std::max(low, at(plane, q));
    for (const Linear& plane : upper_) high = std::min(high, at(plane, q));
    return {low, high};
  }

  [[nodiscard]] bool region_fits(const Polygon& region,
                                 const std::vector<ProjectedTriangle>& triangles) const {
    const AlignedBox2d box = box_of(region);
    if (box.diagonal().norm() <= kSmall * tolerance_) return boxes_fit(over(region, box));
    std::vector<ProjectedTriangle> nearby;
    for (const ProjectedTriangle& triangle : triangles) {
      if (triangle.box.intersects(box)) nearby.push_back(triangle);
    }
    if (nearby.size() > kMaxCutTriangles) return halves_fit(region, nearby);
    const std::vector<Polygon> rest = uncovered(region, nearby);
    return std::ranges::all_of(rest, [&](const Polygon& fragment) {
      Vector2d middle = Vector2d::Zero();
      for (const Vector2d& q : fragment) middle += q / static_cast<double>(fragment.size());
      const auto [low, high] = heights(middle);
      for (const double z : {low, high}) {
        if (!is_near(global({middle.x(), middle.y(), z}))) return false;
      }
      return halves_fit(fragment, nearby);
    });
  }

  [[nodiscard]] bool halves_fit(const Polygon& region,
                                const std::vector<ProjectedTriangle>& triangles) const {
    const AlignedBox2d box = box_of(region);
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    Linear line = Linear::Zero();
    line[axis] = 1.0;
    line.z() = -box.center()[axis];
    const auto [below, above] = cut(region, line);
    return region_fits(below, triangles) && region_fits(above, triangles);
  }

  // A box that contains the piece over the region.
  [[nodiscard]] AlignedBox3d over(const Polygon& region, const AlignedBox2d& box) const {
    double low = box_.min().z();
    double high = box_.max().z();
    for (const Linear& plane : lower_) low = std::max(low, -highest(-plane, region));
    for (const Linear& plane : upper_) high = std::min(high, highest(plane, region));
    return {Vector3d(box.min().x(), box.min().y(), low),
            Vector3d(box.max().x(), box.max().y(), std::max(low, high))};
  }

  // True if every point of the piece in this box is near the surface.
  [[nodiscard]] bool boxes_fit(const AlignedBox3d& whole) const {
    std::queue<AlignedBox3d> boxes;
    boxes.push(whole);
    while (!boxes.empty()) {
      const AlignedBox3d box = boxes.front();
      boxes.pop();
      const Vector3d centre = global(box.center());
      if (const auto triangle = soup_.nearest(centre, reach_)) {
        if (is_near_whole(box, *triangle)) continue;
      }
      // By projection, no point of the hull in this box is farther from x than from the centre.
      const double radius = box.diagonal().norm() / 2.0;
      const Vector3d x = nearest_in_hull(vertices_, centre);
      if ((x - centre).norm() > radius) continue;
      if (!is_near(x)) return false;
      if (radius <= margin()) continue;
      Eigen::Index axis = 0;
      box.sizes().maxCoeff(&axis);
      AlignedBox3d low = box;
      AlignedBox3d high = box;
      low.max()[axis] = high.min()[axis] = box.center()[axis];
      boxes.push(low);
      boxes.push(high);
    }
    return true;
  }

  [[nodiscard]] bool is_near_whole(const AlignedBox3d& box, std::size_t triangle) const {
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d c = global(box.corner(static_cast<AlignedBox3d::CornerType>(corner)));
      if (soup_.distance(triangle, c) > reach_) return false;
    }
    return true;
  }

  const std::vector<Vector3d>& vertices_;
  const TriangleSoup& soup_;
  double tolerance_;
  double reach_;
  Vector3d origin_;
  // Rotation to axes u, v (the projection) and the height, along the thinnest axis.
  Eigen::Matrix3d R_;
  std::vector<Vector3d> points_;  // Vertices in these axes.
  AlignedBox3d box_;
  std::vector<Linear> upper_;
  std::vector<Linear> lower_;
};

}  // namespace

bool fits_surface(const Polytope& piece, const TriangleSoup& soup, double tolerance) {
  return HullFit(piece, soup, tolerance).holds();
}

}  // namespace dive::planning
