#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "planning/world/box_tree.h"
#include "planning/world/mesh.h"
#include "planning/world/nearest_in_hull.h"

namespace dive::planning {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kRounding = 1e-6;        // m: pieces are larger than their hull by this
constexpr double kSimplify = 0.2;         // of the tolerance: what a corner left out may cost
constexpr std::size_t kMostCorners = 24;  // of a piece
constexpr std::size_t kMostParts = 5;     // before they are joined, for each piece allowed

// Nearest point of a triangle; Ericson, Real-Time Collision Detection, 5.1.5: by the Voronoi region
// that p lies in.
Vector3d nearest_in_triangle(const std::array<Vector3d, 3>& t, const Vector3d& p) {
  const Vector3d ab = t[1] - t[0];
  const Vector3d ac = t[2] - t[0];
  const Vector3d ap = p - t[0];
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return t[0];
  const Vector3d bp = p - t[1];
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return t[1];
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return t[0] + d1 / (d1 - d3) * ab;
  const Vector3d cp = p - t[2];
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return t[2];
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return t[0] + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    return t[1] + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1]);
  }
  return t[0] + (vb * ab + vc * ac) / (va + vb + vc);
}

// The whole surface, asked for its distance.
class Soup {
 public:
  explicit Soup(std::vector<std::array<Vector3d, 3>> triangles)
      : triangles_(std::move(triangles)), tree_(boxes_of(triangles_)) {}

  [[nodiscard]] double distance(std::size_t triangle, const Vector3d& p) const {
    return (nearest_in_triangle(triangles_[triangle], p) - p).norm();
  }
  // The triangle nearest to p, if one is within `reach`.
  [[nodiscard]] std::optional<std::size_t> nearest(const Vector3d& p, double reach) const {
    std::optional<std::size_t> best;
    tree_.visit(p, reach, [&](std::size_t i) {
      if (const double d = distance(i, p); d <= reach) {
        reach = d;
        best = i;
      }
      return reach;
    });
    return best;
  }

  [[nodiscard]] const std::vector<std::array<Vector3d, 3>>& triangles() const { return triangles_; }

 private:
  static std::vector<AlignedBox3d> boxes_of(const std::vector<std::array<Vector3d, 3>>& triangles) {
    std::vector<AlignedBox3d> boxes;
    boxes.reserve(triangles.size());
    for (const auto& t : triangles) {
      boxes.emplace_back(t[0]);
      boxes.back().extend(t[1]).extend(t[2]);
    }
    return boxes;
  }

  std::vector<std::array<Vector3d, 3>> triangles_;
  BoxTree tree_;
};

using Polygon = std::vector<Vector3d>;  // Flat and convex: a triangle, or what was cut off one.
using Patch = std::vector<Polygon>;

AlignedBox3d box_of(const Polygon& polygon) {
  AlignedBox3d box;
  for (const Vector3d& v : polygon) box.extend(v);
  return box;
}

// Both sides of the plane x[axis] = at (Sutherland and Hodgman 1974).
std::pair<Polygon, Polygon> cut(const Polygon& polygon, Eigen::Index axis, double at) {
  std::pair<Polygon, Polygon> sides;
  auto& [below, above] = sides;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d& a = polygon[i];
    const Vector3d& b = polygon[(i + 1) % polygon.size()];
    if (a[axis] <= at) below.push_back(a);
    if (a[axis] >= at) above.push_back(a);
    if ((a[axis] - at) * (b[axis] - at) >= 0.0) continue;
    Vector3d crossing = a + (at - a[axis]) / (b[axis] - a[axis]) * (b - a);
    crossing[axis] = at;
    below.push_back(crossing);
    above.push_back(crossing);
  }
  return sides;
}

// The polygons, cut where they are larger than that.
Patch cut_to_size(std::vector<std::array<Vector3d, 3>> triangles, double largest) {
  Patch todo;
  for (const auto& t : triangles) todo.emplace_back(t.begin(), t.end());
  Patch small;
  while (!todo.empty()) {
    const Polygon polygon = std::move(todo.back());
    todo.pop_back();
    const AlignedBox3d box = box_of(polygon);
    if (box.diagonal().norm() <= largest) {
      small.push_back(polygon);
      continue;
    }
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    auto [below, above] = cut(polygon, axis, box.center()[axis]);
    todo.push_back(std::move(below));
    todo.push_back(std::move(above));
  }
  return small;
}

// The volume, but for a factor, of the ellipsoid with the moments of an area: what a division is to
// make small. It punishes sides that are not flat, and sides that lie among each other.
class Spread {
 public:
  void add(const Polygon& polygon) {
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
      const std::array<Vector3d, 3> t{polygon[0], polygon[i], polygon[i + 1]};
      const double area = (t[1] - t[0]).cross(t[2] - t[0]).norm() / 2.0;
      const Vector3d sum = t[0] + t[1] + t[2];
      area_ += area;
      first_ += area / 3.0 * sum;
      second_ += area / 12.0 * (sum * sum.transpose());
      for (const Vector3d& v : t) second_ += area / 12.0 * (v * v.transpose());
    }
  }
  [[nodiscard]] double volume() const {
    if (area_ <= 0.0) return 0.0;
    const Vector3d mean = first_ / area_;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
        second_ / area_ - mean * mean.transpose(), Eigen::EigenvaluesOnly);
    return std::sqrt(std::max(solver.eigenvalues().prod(), 0.0));
  }

 private:
  double area_ = 0.0;
  Vector3d first_ = Vector3d::Zero();
  Eigen::Matrix3d second_ = Eigen::Matrix3d::Zero();
};

// Unit normal, turned so that opposite ones agree: which way a triangle faces means nothing.
Vector3d normal_of(const Polygon& polygon) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    sum += (polygon[i] - polygon[0]).cross(polygon[i + 1] - polygon[0]);
  }
  Eigen::Index largest = 0;
  sum.cwiseAbs().maxCoeff(&largest);
  return (sum(largest) < 0.0 ? -1.0 : 1.0) * sum.normalized();
}

// Puts each polygon on one of two sides, by where it is or by how it lies, so that the sides are as
// flat as can be.
std::pair<Patch, Patch> divide(Patch patch) {
  constexpr int kKeys = 6;
  std::array<std::vector<double>, kKeys> keys;
  for (const Polygon& polygon : patch) {
    const Vector3d centre = box_of(polygon).center();
    const Vector3d normal = normal_of(polygon);
    for (int k = 0; k < 3; ++k) {
      keys[static_cast<std::size_t>(k)].push_back(centre(k));
      keys[static_cast<std::size_t>(k) + 3].push_back(normal(k));
    }
  }
  double best = std::numeric_limits<double>::infinity();
  std::vector<bool> best_side(patch.size());
  for (const std::vector<double>& key : keys) {
    const auto [low, high] = std::ranges::minmax(key);
    if (!(high > low)) continue;
    const double middle = std::min(low + (high - low) / 2.0, std::nextafter(high, low));
    std::array<Spread, 2> spreads;
    std::vector<bool> side;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      side.push_back(key[i] > middle);
      spreads[side.back() ? 1 : 0].add(patch[i]);
    }
    const double cost = spreads[0].volume() + spreads[1].volume();
    if (cost < best) {
      best = cost;
      best_side = std::move(side);
    }
  }
  // Nothing tells them apart: any half will do.
  if (!std::isfinite(best)) {
    for (std::size_t i = 0; i < patch.size() / 2; ++i) best_side[i] = true;
  }
  std::pair<Patch, Patch> sides;
  for (std::size_t i = 0; i < patch.size(); ++i) {
    (best_side[i] ? sides.second : sides.first).push_back(std::move(patch[i]));
  }
  return sides;
}

std::vector<Vector3d> distinct(std::vector<Vector3d> points) {
  const auto less = [](const Vector3d& a, const Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::ranges::sort(points, less);
  const auto rest = std::ranges::unique(points);
  points.erase(rest.begin(), rest.end());
  return points;
}

// Some of the points, few, and a radius that holds the others: those farthest out, one at a time.
// Nothing when it would take too many.
std::optional<Polytope> simplify(std::vector<Vector3d> points, double slack) {
  Polytope piece;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::ranges::minmax_element(points, {}, [axis](const Vector3d& v) { return v[axis]; });
    piece.vertices.push_back(*low);
    piece.vertices.push_back(*high);
  }
  piece.vertices = distinct(std::move(piece.vertices));
  for (;;) {
    double most = 0.0;
    double covered = 0.0;
    Vector3d farthest = points.front();
    std::erase_if(points, [&](const Vector3d& p) {
      const double beyond = (p - nearest_in_hull(piece.vertices, p)).norm();
      if (beyond > most) {
        most = beyond;
        farthest = p;
      }
      if (beyond <= slack) covered = std::max(covered, beyond);
      return beyond <= slack;
    });
    piece.radius = std::max(piece.radius, covered);
    if (points.empty()) break;
    if (piece.vertices.size() == kMostCorners) return std::nullopt;
    piece.vertices.push_back(farthest);
  }
  piece.radius += kRounding;
  return piece;
}

// Axes along which the points spread most and least: boxes along them fit a flat piece closely.
Eigen::Matrix3d principal_axes(const std::vector<Vector3d>& points) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& v : points) mean += v / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& v : points) spread += (v - mean) * (v - mean).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
}

// Is every point of the piece within `tolerance` of the surface? Asked of ever smaller boxes that
// hold the piece: the distance to one triangle is convex, so a box is near it when its corners are.
// A margin makes boxes as small as that need no smaller ones: some snug pieces are refused.
bool is_snug(const Polytope& piece, const Soup& soup, double tolerance) {
  const double reach = tolerance - piece.radius;
  const double margin = 0.25 * tolerance;
  // What is not snug mostly shows it half way between two corners.
  for (const Vector3d& a : piece.vertices) {
    for (const Vector3d& b : piece.vertices) {
      if (!soup.nearest((a + b) / 2.0, reach - margin)) return false;
    }
  }
  const Eigen::Matrix3d axes = principal_axes(piece.vertices);
  AlignedBox3d all;
  for (const Vector3d& v : piece.vertices) all.extend(axes.transpose() * v);
  std::queue<AlignedBox3d> boxes;
  boxes.push(all);
  while (!boxes.empty()) {
    const AlignedBox3d box = boxes.front();
    boxes.pop();
    const Vector3d centre = axes * box.center();
    if (const auto triangle = soup.nearest(centre, reach)) {
      bool near = true;
      for (int corner = 0; corner < 8 && near; ++corner) {
        const Vector3d c = axes * box.corner(static_cast<AlignedBox3d::CornerType>(corner));
        near = soup.distance(*triangle, c) <= reach;
      }
      if (near) continue;
    }
    // No point of the hull in this box is farther from x than from the centre of the box.
    const double radius = box.diagonal().norm() / 2.0;
    const Vector3d x = nearest_in_hull(piece.vertices, centre);
    if ((x - centre).norm() > radius) continue;
    if (!soup.nearest(x, reach - margin)) return false;
    if (radius <= margin) continue;
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

// A part of the surface and the piece that stands for it.
struct Part {
  std::vector<Vector3d> points;
  Polytope piece;
  AlignedBox3d box;
  int joined = 0;  // In which of the merger's passes it last grew.
};

AlignedBox3d box_of(const std::vector<Vector3d>& points, double margin) {
  AlignedBox3d box;
  for (const Vector3d& v : points) box.extend(v);
  box.min().array() -= margin;
  box.max().array() += margin;
  return box;
}

// The hull of the points, if it is snug; of one polygon it always is.
std::optional<Part> part_of(std::vector<Vector3d> points, const Soup& soup,
                            const DecompositionOptions& options, bool is_polygon) {
  const AlignedBox3d box = box_of(points, kRounding);
  if (is_polygon) return Part{points, Polytope{points, kRounding}, box};
  if (box.diagonal().norm() > options.largest) return std::nullopt;
  const double slack = kSimplify * options.tolerance;
  const bool tiny = box.diagonal().norm() <= options.tolerance / 2.0;
  points = distinct(std::move(points));
  // Most that are too large show it by a few of their points.
  constexpr std::size_t kSample = 32;
  if (!tiny && points.size() > 2 * kSample) {
    std::vector<Vector3d> some;
    for (std::size_t i = 0; i < kSample; ++i) some.push_back(points[i * points.size() / kSample]);
    const std::optional<Polytope> within = simplify(std::move(some), slack);
    if (!within || !is_snug({within->vertices, 0.0}, soup, options.tolerance)) {
      return std::nullopt;
    }
  }
  std::optional<Polytope> piece = simplify(points, slack);
  if (!piece || (!tiny && !is_snug(*piece, soup, options.tolerance))) return std::nullopt;
  return Part{std::move(points), std::move(*piece), box};
}

// Joins parts that touch while one piece will do for both, small ones first.
class Merger {
 public:
  Merger(std::vector<Part> parts, const Soup& soup, const DecompositionOptions& options)
      : parts_(std::move(parts)), soup_(soup), options_(options) {}

  std::vector<Part> run() {
    for (pass_ = 1; pass_ <= kMostPasses; ++pass_) {
      if (!run_once()) break;
    }
    return std::move(parts_);
  }

 private:
  static constexpr int kMostPasses = 8;
  static constexpr int kMostTries = 6;  // of a part in a pass

  bool run_once() {
    std::ranges::stable_sort(parts_, {}, [](const Part& p) { return p.box.diagonal().norm(); });
    std::vector<AlignedBox3d> boxes;
    for (const Part& part : parts_) boxes.push_back(part.box);
    const BoxTree tree(boxes);
    std::vector<bool> gone(parts_.size());
    bool any = false;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!gone[i]) any = grow(i, tree, gone) || any;
    }
    std::vector<Part> kept;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!gone[i]) kept.push_back(std::move(parts_[i]));
    }
    parts_ = std::move(kept);
    return any;
  }

  bool grow(std::size_t i, const BoxTree& tree, std::vector<bool>& gone) {
    std::vector<std::pair<double, std::size_t>> neighbours;
    tree.visit(parts_[i].box, 0.0, [&](std::size_t k) {
      // What failed in the last pass fails again.
      const bool is_new = std::max(parts_[i].joined, parts_[k].joined) >= pass_ - 1;
      if (k != i && !gone[k] && is_new) {
        neighbours.emplace_back(parts_[i].box.merged(parts_[k].box).diagonal().norm(), k);
      }
      return 0.0;
    });
    std::ranges::sort(neighbours);
    int tries = 0;
    bool grown = false;
    for (const auto& [size, k] : neighbours) {
      if (++tries > kMostTries || size > options_.largest) break;
      std::vector<Vector3d> points = parts_[i].points;
      points.insert(points.end(), parts_[k].points.begin(), parts_[k].points.end());
      std::optional<Part> both = part_of(std::move(points), soup_, options_, false);
      if (!both) continue;
      parts_[i] = std::move(*both);
      parts_[i].joined = pass_;
      gone[k] = true;
      grown = true;
    }
    return grown;
  }

  std::vector<Part> parts_;
  const Soup& soup_;
  const DecompositionOptions& options_;
  int pass_ = 0;
};

std::vector<std::array<Vector3d, 3>> proper_triangles(const TriangleMesh& mesh) {
  std::vector<std::array<Vector3d, 3>> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::array<Vector3d, 3> t{mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]};
    if ((t[1] - t[0]).cross(t[2] - t[0]).norm() > 0.0) triangles.push_back(t);
  }
  return triangles;
}

}  // namespace

tl::expected<std::vector<Polytope>, std::string> decompose(const TriangleMesh& mesh,
                                                           const DecompositionOptions& options) {
  const Soup soup(proper_triangles(mesh));
  std::vector<Patch> todo{cut_to_size(soup.triangles(), options.largest)};
  if (todo.front().empty()) todo.clear();
  std::vector<Part> parts;
  while (!todo.empty()) {
    Patch patch = std::move(todo.back());
    todo.pop_back();
    std::vector<Vector3d> points;
    for (const Polygon& polygon : patch) {
      points.insert(points.end(), polygon.begin(), polygon.end());
    }
    if (auto part = part_of(std::move(points), soup, options, patch.size() == 1)) {
      parts.push_back(std::move(*part));
      continue;
    }
    if (parts.size() + todo.size() >= kMostParts * options.most_pieces) {
      return tl::unexpected(fmt::format("it would take more than {} convex pieces at {:.0f} mm",
                                        options.most_pieces, 1e3 * options.tolerance));
    }
    auto [one, other] = divide(std::move(patch));
    todo.push_back(std::move(one));
    todo.push_back(std::move(other));
  }
  std::vector<Polytope> pieces;
  for (Part& part : Merger(std::move(parts), soup, options).run()) {
    pieces.push_back(std::move(part.piece));
  }
  return pieces;
}

}  // namespace dive::planning
