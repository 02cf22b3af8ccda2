#include "planning/mapping/flat_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include "planning/world/obstacle_update.h"

namespace dive::planning {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kBent = 0.7F;       // cosine between the normals of the two sides of an edge
constexpr float kBentShare = 0.1F;  // least share of triangles beyond kBent for a split at an edge
constexpr int kBits = 64;           // cells along one side of a piece's raster image

/// Axes of a patch: the first is its longest, the last its normal.
struct Frame {
  Vector3f centre;
  Eigen::Matrix3f axes;  // columns
  [[nodiscard]] Vector2f flat(const Vector3f& p) const {
    return axes.leftCols<2>().transpose() * (p - centre);
  }
  [[nodiscard]] float height(const Vector3f& p) const { return axes.col(2).dot(p - centre); }
};

// Convex hull, counter-clockwise (Andrew 1979). Sorts the points.
void hull_of(std::vector<Vector2f>& points, std::vector<Vector2f>& hull) {
  std::sort(points.begin(), points.end(), [](const Vector2f& a, const Vector2f& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  const auto turns_right = [](const Vector2f& a, const Vector2f& b, const Vector2f& c) {
    const Vector2f u = b - a;
    const Vector2f v = c - b;
    return u.x() * v.y() - u.y() * v.x() <= 0.0F;
  };
  hull.clear();
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = hull.size();
    for (const Vector2f& p : points) {
      while (hull.size() >= start + 2 && turns_right(hull[hull.size() - 2], hull.back(), p)) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  if (hull.empty()) hull.push_back(points.front());
}

/// Raster image of the surface, to test whether a hull covers area outside it.
class Image {
 public:
  Image(float grain, const Vector2f& low) : grain_(grain), low_(low) {}

  void mark(const Vector2f& p) {
    const auto [x, y] = cell(p);
    rows_[static_cast<std::size_t>(y)] |= std::uint64_t{1} << x;
  }
  // Marks everything within one cell of a mark as surface.
  void grow() {
    std::array<std::uint64_t, kBits> wide{};
    for (std::size_t y = 0; y < kBits; ++y) wide[y] = rows_[y] | (rows_[y] << 1) | (rows_[y] >> 1);
    for (std::size_t y = 0; y < kBits; ++y) {
      rows_[y] = wide[y] | (y > 0 ? wide[y - 1] : 0) | (y + 1 < kBits ? wide[y + 1] : 0);
    }
  }
  // True if every cell whose middle is within the polygon is marked.
  [[nodiscard]] bool covers(const std::vector<Vector2f>& polygon) const {
    for (int y = 0; y < kBits; ++y) {
      const float middle = low_.y() + (static_cast<float>(y) + 0.5F) * grain_;
      float left = std::numeric_limits<float>::infinity();
      float right = -left;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vector2f& a = polygon[i];
        const Vector2f& b = polygon[(i + 1) % polygon.size()];
        if ((a.y() - middle) * (b.y() - middle) > 0.0F || a.y() == b.y()) continue;
        const float x = a.x() + (middle - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
        left = std::min(left, x);
        right = std::max(right, x);
      }
      if (left > right) continue;
      const int first = std::max(0, static_cast<int>(std::ceil((left - low_.x()) / grain_ - 0.5F)));
      const int last =
          std::min(kBits - 1, static_cast<int>(std::floor((right - low_.x()) / grain_ - 0.5F)));
      for (int x = first; x <= last; ++x) {
        if ((rows_[static_cast<std::size_t>(y)] >> x & 1) == 0) return false;
      }
    }
    return true;
  }

 private:
  [[nodiscard]] std::pair<int, int> cell(const Vector2f& p) const {
    const Vector2f at = (p - low_) / grain_;
    return {std::clamp(static_cast<int>(at.x()), 0, kBits - 1),
            std::clamp(static_cast<int>(at.y()), 0, kBits - 1)};
  }
  float grain_;
  Vector2f low_;
  std::array<std::uint64_t, kBits> rows_{};
};

class Division {
 public:
  Division(std::span<const Vector3f> points, std::span<const Triangle> triangles,
           const FlatPieceOptions& options, std::vector<Polytope>& pieces)
      : points_(points), options_(options), pieces_(pieces) {
    patches_.reserve(triangles.size());
    for (const Triangle& t : triangles) {
      const Vector3f& a = points[t[0]];
      const Vector3f& b = points[t[1]];
      const Vector3f& c = points[t[2]];
      const Vector3f normal = (b - a).cross(c - a);
      const float twice = normal.norm();
      patches_.push_back(
          {t, (a + b + c) / 3.0F, twice > 0.0F ? Vector3f(normal / twice) : normal, 0.5F * twice});
    }
  }

  void run() { divide(patches_); }

 private:
  struct Patch {
    Triangle corners;
    Vector3f middle;
    Vector3f normal;  // unit, either sign
    float area;
  };
  using Patches = std::span<Patch>;

  [[nodiscard]] Frame frame_of(Patches patches) const {
    Frame frame;
    float area = 0.0F;
    frame.centre.setZero();
    for (const Patch& patch : patches) {
      frame.centre += patch.area * patch.middle;
      area += patch.area;
    }
    frame.centre = area > 0.0F ? Vector3f(frame.centre / area) : patches.front().middle;
    Eigen::Matrix3f spread = Eigen::Matrix3f::Zero();
    for (const Patch& patch : patches) {
      for (const std::uint32_t corner : patch.corners) {
        const Vector3f from = points_[corner] - frame.centre;
        spread += (patch.area + 1e-6F) * from * from.transpose();
      }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> eigen(spread);
    frame.axes.col(0) = eigen.eigenvectors().col(2);
    frame.axes.col(1) = eigen.eigenvectors().col(1);
    frame.axes.col(2) = frame.axes.col(0).cross(frame.axes.col(1));
    return frame;
  }

  void divide(Patches patches) {
    if (patches.empty()) return;
    const Frame frame = frame_of(patches);
    if (accept(patches, frame) || patches.size() == 1) return;
    Patches::iterator middle = by_normal(patches, frame);
    if (middle == patches.begin() || middle == patches.end()) middle = by_place(patches, frame);
    const auto count = static_cast<std::size_t>(middle - patches.begin());
    divide(patches.first(count));
    divide(patches.subspan(count));
  }

  // Makes one piece of the patches if it is flat and covers only surface.
  bool accept(Patches patches, const Frame& frame) {
    float low = std::numeric_limits<float>::infinity();
    float high = -low;
    flat_.clear();
    for (const Patch& patch : patches) {
      for (const std::uint32_t corner : patch.corners) {
        const float height = frame.height(points_[corner]);
        low = std::min(low, height);
        high = std::max(high, height);
        flat_.push_back(frame.flat(points_[corner]));
      }
    }
    const bool is_last = patches.size() == 1;
    if (!is_last && high - low > 2.0F * static_cast<float>(options_.flat_m)) return false;
    Vector2f least = flat_.front();
    Vector2f most = flat_.front();
    for (const Vector2f& p : flat_) {
      least = least.cwiseMin(p);
      most = most.cwiseMax(p);
    }
    const auto grain = static_cast<float>(options_.grain_m);
    if (!is_last && (most - least).maxCoeff() >= static_cast<float>(kBits) * grain) return false;
    const Image surface = image(grain, least);  // first, because sorting loses the triangles
    hull_of(flat_, hull_);
    if (!is_last && !surface.covers(hull_)) return false;
    if (hull_.size() > kMaxPieceVertices) return false;
    emit(frame, low, high);
    return true;
  }

  // Raster image of the triangles whose corners are in flat_, three by three.
  [[nodiscard]] Image image(float grain, const Vector2f& least) const {
    Image image(grain, least);
    for (std::size_t i = 0; i + 2 < flat_.size(); i += 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2f& a = flat_[i + k];
        const Vector2f& b = flat_[i + (k + 1) % 3];
        image.mark(a);
        const int steps = static_cast<int>((b - a).lpNorm<Eigen::Infinity>() / (1.5F * grain));
        for (int s = 1; s <= steps; ++s) {
          image.mark(a + static_cast<float>(s) / static_cast<float>(steps + 1) * (b - a));
        }
      }
      image.mark((flat_[i] + flat_[i + 1] + flat_[i + 2]) / 3.0F);
    }
    image.grow();
    return image;
  }

  void emit(const Frame& frame, float low, float high) {
    Polytope piece;
    const Vector3f lift = frame.axes.col(2) * (0.5F * (low + high));
    piece.vertices.reserve(hull_.size());
    for (const Vector2f& corner : hull_) {
      const Vector3f p = frame.centre + lift + frame.axes.leftCols<2>() * corner;
      piece.vertices.push_back(p.cast<double>());
    }
    piece.radius = options_.skin_m + 0.5 * static_cast<double>(high - low);
    pieces_.push_back(std::move(piece));
  }

  // Separates the two sides of an edge by their normals.
  Patches::iterator by_normal(Patches patches, const Frame& frame) const {
    const Vector3f along = frame.axes.col(2);
    const Patch* first = &patches.front();
    for (const Patch& patch : patches) {
      if (std::abs(patch.normal.dot(along)) > std::abs(first->normal.dot(along))) first = &patch;
    }
    const Patch* second = first;
    std::size_t bent = 0;
    for (const Patch& patch : patches) {
      const float cosine = std::abs(patch.normal.dot(first->normal));
      if (cosine < std::abs(second->normal.dot(first->normal))) second = &patch;
      if (cosine < kBent) ++bent;
    }
    const auto many = static_cast<float>(patches.size());
    if (static_cast<float>(bent) < kBentShare * many) return patches.begin();
    const Vector3f n1 = first->normal;
    const Vector3f n2 = second->normal;
    return std::partition(patches.begin(), patches.end(), [&](const Patch& patch) {
      return std::abs(patch.normal.dot(n1)) >= std::abs(patch.normal.dot(n2));
    });
  }

  static Patches::iterator by_place(Patches patches, const Frame& frame) {
    const Vector3f axis = frame.axes.col(0);
    const auto middle = patches.begin() + static_cast<std::ptrdiff_t>(patches.size() / 2);
    std::nth_element(patches.begin(), middle, patches.end(), [&](const Patch& a, const Patch& b) {
      return axis.dot(a.middle) < axis.dot(b.middle);
    });
    return middle;
  }

  std::span<const Vector3f> points_;
  FlatPieceOptions options_;
  std::vector<Polytope>& pieces_;
  std::vector<Patch> patches_;
  std::vector<Vector2f> flat_;
  std::vector<Vector2f> hull_;
};

}  // namespace

void flat_pieces(std::span<const Vector3f> points, std::span<const Triangle> triangles,
                 const FlatPieceOptions& options, std::vector<Polytope>& pieces) {
  Division(points, triangles, options, pieces).run();
}

}  // namespace dive::planning
