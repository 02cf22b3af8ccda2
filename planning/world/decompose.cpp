#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "planning/world/box_tree.h"
#include "planning/world/hull_fit.h"
#include "planning/world/mesh.h"
#include "planning/world/nearest_in_hull.h"
#include "planning/world/triangle_soup.h"

namespace dive::planning {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kRounding = 1e-6;       // m: pieces are larger than their hull by this
constexpr double kSimplify = 0.2;        // share of the tolerance that leaving out corners may use
constexpr std::size_t kMaxCorners = 24;  // limit per piece
constexpr std::size_t kMaxParts = 5;     // limit before joining, for each piece allowed

// Triangles of a soup, by number: a range of the one array that all patches share.
using Patch = std::span<std::uint32_t>;

// Area, first and second moments of a triangle, or of several, about an origin near them.
struct Moments {
  double area = 0.0;
  Vector3d first = Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();

  void add(const Moments& other) {
    area += other.area;
    first += other.first;
    second += other.second;
  }
  // Measure of the volume of the ellipsoid with these moments, which a division should minimise: it
  // penalises sides that are not flat, and sides that overlap.
  [[nodiscard]] double spread() const {
    if (area <= 0.0) return 0.0;
    const Vector3d mean = first / area;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
        second / area - mean * mean.transpose(), Eigen::EigenvaluesOnly);
    return std::sqrt(std::max(solver.eigenvalues().prod(), 0.0));
  }
};

Moments moments_of(const std::array<Vector3d, 3>& t) {
  Moments moments;
  const Vector3d sum = t[0] + t[1] + t[2];
  moments.area = (t[1] - t[0]).cross(t[2] - t[0]).norm() / 2.0;
  moments.first = moments.area / 3.0 * sum;
  moments.second = sum * sum.transpose();
  for (const Vector3d& v : t) moments.second += v * v.transpose();
  moments.second *= moments.area / 12.0;
  return moments;
}

// Criteria for dividing a patch: the centre of a triangle's box, and its unit normal, with opposite
// normals made equal, because a triangle's orientation has no meaning.
using Keys = Eigen::Matrix<double, 6, 1>;

Keys keys_of(const std::array<Vector3d, 3>& t) {
  const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  Eigen::Index largest = 0;
  normal.cwiseAbs().maxCoeff(&largest);
  Keys keys;
  keys << AlignedBox3d(t[0]).extend(t[1]).extend(t[2]).center(),
      (normal(largest) < 0.0 ? -1.0 : 1.0) * normal.normalized();
  return keys;
}

// Cuts a patch in two, by the position or the orientation of its triangles, so that both sides are
// as flat as possible.
std::pair<Patch, Patch> divide(Patch patch, const TriangleSoup& soup) {
  Keys low = Keys::Constant(std::numeric_limits<double>::infinity());
  Keys high = -low;
  for (const std::uint32_t i : patch) {
    const Keys keys = keys_of(soup.corners(i));
    low = low.cwiseMin(keys);
    high = high.cwiseMax(keys);
  }
  Keys middle = low + (high - low) / 2.0;
  for (Eigen::Index k = 0; k < middle.size(); ++k) {
    middle(k) = std::min(middle(k), std::nextafter(high(k), low(k)));
  }
  const Vector3d origin = middle.head<3>();
  std::array<std::array<Moments, 2>, 6> sides;
  for (const std::uint32_t i : patch) {
    std::array<Vector3d, 3> t = soup.corners(i);
    const Keys keys = keys_of(t);
    for (Vector3d& v : t) v -= origin;
    const Moments moments = moments_of(t);
    for (std::size_t k = 0; k < sides.size(); ++k) {
      const auto key = static_cast<Eigen::Index>(k);
      sides[k][keys(key) > middle(key) ? 1 : 0].add(moments);
    }
  }
  Eigen::Index best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const auto key = static_cast<Eigen::Index>(k);
    const double cost = sides[k][0].spread() + sides[k][1].spread();
    if (!(high(key) > low(key)) || !(cost < least)) continue;
    least = cost;
    best = key;
  }
  // If nothing distinguishes them, any half will do.
  std::size_t half = patch.size() / 2;
  if (best >= 0) {
    const auto above = std::ranges::stable_partition(
        patch, [&](std::uint32_t i) { return keys_of(soup.corners(i))(best) <= middle(best); });
    half = patch.size() - above.size();
  }
  return {patch.first(half), patch.subspan(half)};
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

// A small subset of the points, with a radius that covers the others; adds the farthest point, one
// at a time. Absent if it would need too many.
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
    if (piece.vertices.size() == kMaxCorners) return std::nullopt;
    piece.vertices.push_back(farthest);
  }
  piece.radius += kRounding;
  return piece;
}

// A part of the surface and the piece that represents it.
struct Part {
  std::vector<std::uint32_t> vertices;  // Vertices of the mesh, unique, in ascending order.
  Polytope piece;
  AlignedBox3d box;
  int joined = 0;  // The last pass of the merger in which the part grew.
};

// Makes parts from patches, and from other parts.
class PartMaker {
 public:
  PartMaker(const TriangleMesh& mesh, const TriangleSoup& soup, const DecompositionOptions& options)
      : mesh_(mesh), soup_(soup), options_(options) {}

  // The hull of a patch, if it fits; that of a single triangle always fits.
  [[nodiscard]] std::optional<Part> of_patch(Patch patch) const {
    AlignedBox3d box;
    for (const std::uint32_t i : patch) box.extend(soup_.box(i));
    box.min().array() -= kRounding;
    box.max().array() += kRounding;
    if (patch.size() > 1 && box.diagonal().norm() > options_.largest) return std::nullopt;
    std::vector<std::uint32_t> vertices;
    vertices.reserve(3 * patch.size());
    for (const std::uint32_t i : patch) {
      const auto& corners = soup_.vertices(i);
      vertices.insert(vertices.end(), corners.begin(), corners.end());
    }
    std::ranges::sort(vertices);
    const auto rest = std::ranges::unique(vertices);
    vertices.erase(rest.begin(), rest.end());
    if (patch.size() > 1) return of_vertices(std::move(vertices), box);
    Part part{std::move(vertices), Polytope{{}, kRounding}, box};
    for (const std::uint32_t i : part.vertices) part.piece.vertices.push_back(mesh_.vertices[i]);
    return part;
  }

  // One hull for both, if it fits.
  [[nodiscard]] std::optional<Part> of_both(const Part& a, const Part& b) const {
    const AlignedBox3d box = a.box.merged(b.box);
    if (box.diagonal().norm() > options_.largest) return std::nullopt;
    std::vector<std::uint32_t> vertices;
    std::ranges::set_union(a.vertices, b.vertices, std::back_inserter(vertices));
    return of_vertices(std::move(vertices), box);
  }

 private:
  [[nodiscard]] std::optional<Part> of_vertices(std::vector<std::uint32_t> vertices,
                                                const AlignedBox3d& box) const {
    const double slack = kSimplify * options_.tolerance;
    const bool tiny = box.diagonal().norm() <= options_.tolerance / 2.0;
    // A few of the points suffice to reject most hulls that are too large.
    constexpr std::size_t kSample = 32;
    if (!tiny && vertices.size() > 2 * kSample) {
      std::vector<Vector3d> some;
      some.reserve(kSample);
      for (std::size_t i = 0; i < kSample; ++i) {
        some.push_back(mesh_.vertices[vertices[i * vertices.size() / kSample]]);
      }
      const std::optional<Polytope> within = simplify(std::move(some), slack);
      if (!within || !fits_surface({within->vertices, 0.0}, soup_, options_.tolerance)) {
        return std::nullopt;
      }
    }
    std::vector<Vector3d> points;
    points.reserve(vertices.size());
    for (const std::uint32_t i : vertices) points.push_back(mesh_.vertices[i]);
    std::optional<Polytope> piece = simplify(distinct(std::move(points)), slack);
    if (!piece || (!tiny && !fits_surface(*piece, soup_, options_.tolerance))) return std::nullopt;
    return Part{std::move(vertices), std::move(*piece), box};
  }

  const TriangleMesh& mesh_;
  const TriangleSoup& soup_;
  const DecompositionOptions& options_;
};

// Joins touching parts if one piece fits both, small ones first.
class Merger {
 public:
  Merger(std::vector<Part> parts, const PartMaker& maker, double largest)
      : parts_(std::move(parts)), maker_(maker), largest_(largest) {}

  std::vector<Part> run() {
    for (pass_ = 1; pass_ <= kMaxPasses; ++pass_) {
      if (!run_once()) break;
    }
    return std::move(parts_);
  }

 private:
  static constexpr int kMaxPasses = 8;
  static constexpr int kMaxTries = 6;  // attempts per part in a pass

  bool run_once() {
    std::ranges::stable_sort(parts_, {}, [](const Part& p) { return p.box.diagonal().norm(); });
    const BoxTree tree = tree_of_parts();
    std::vector<bool> gone(parts_.size());
    bool any = false;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!gone[i]) any = grow(i, tree, gone) || any;
    }
    std::size_t kept = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (gone[i]) continue;
      if (kept != i) parts_[kept] = std::move(parts_[i]);
      ++kept;
    }
    parts_.resize(kept);
    return any;
  }

  [[nodiscard]] BoxTree tree_of_parts() const {
    std::vector<AlignedBox3d> boxes;
    boxes.reserve(parts_.size());
    for (const Part& part : parts_) boxes.push_back(part.box);
    return BoxTree(boxes);
  }

  bool grow(std::size_t i, const BoxTree& tree, std::vector<bool>& gone) {
    if (parts_[i].box.diagonal().norm() > largest_) return false;
    std::vector<std::pair<double, std::size_t>> neighbours;
    tree.visit(parts_[i].box, 0.0, [&](std::size_t k) {
      // A pair that failed in the last pass fails again.
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
      if (++tries > kMaxTries || size > largest_) break;
      std::optional<Part> both = maker_.of_both(parts_[i], parts_[k]);
      if (!both) continue;
      parts_[i] = std::move(*both);
      parts_[i].joined = pass_;
      parts_[k] = {};
      gone[k] = true;
      grown = true;
    }
    return grown;
  }

  std::vector<Part> parts_;
  const PartMaker& maker_;
  double largest_;
  int pass_ = 0;
};

tl::unexpected<std::string> too_many(const DecompositionOptions& options) {
  return tl::unexpected(fmt::format("it would take more than {} convex pieces at {:.0f} mm",
                                    options.max_pieces, 1e3 * options.tolerance));
}

}  // namespace

tl::expected<std::vector<Polytope>, std::string> decompose(const TriangleMesh& mesh,
                                                           const DecompositionOptions& options) {
  const TriangleSoup soup(mesh);
  const PartMaker maker(mesh, soup, options);
  std::vector<std::uint32_t> order(soup.size());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<Patch> todo;
  if (!order.empty()) todo.emplace_back(order);
  std::vector<Part> parts;
  while (!todo.empty()) {
    const Patch patch = todo.back();
    todo.pop_back();
    if (auto part = maker.of_patch(patch)) {
      parts.push_back(std::move(*part));
      continue;
    }
    if (parts.size() + todo.size() >= kMaxParts * options.max_pieces) {
      return too_many(options);
    }
    const auto [one, other] = divide(patch, soup);
    todo.push_back(one);
    todo.push_back(other);
  }
  parts = Merger(std::move(parts), maker, options.largest).run();
  if (parts.size() > options.max_pieces) return too_many(options);
  std::vector<Polytope> pieces;
  pieces.reserve(parts.size());
  for (Part& part : parts) pieces.push_back(std::move(part.piece));
  return pieces;
}

}  // namespace dive::planning
