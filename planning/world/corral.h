#pragma once
// Wolfe's corral (Wolfe 1976, "Finding the nearest point in a polytope"): the point of least norm
// in the hull of at most four affinely independent points.

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dive::planning {

/// The current point as a convex combination of its points, each with an index of the caller.
class Corral {
 public:
  Corral(const Eigen::Vector3d& v, std::size_t index) { add(v, index); }

  [[nodiscard]] bool full() const { return size_ == 4; }
  [[nodiscard]] Eigen::Index size() const { return size_; }
  [[nodiscard]] std::size_t index(Eigen::Index i) const {
    return indices_[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] double weight(Eigen::Index i) const { return weights_(i); }

  void add(const Eigen::Vector3d& v, std::size_t index) {
    points_.col(size_) = v;
    indices_[static_cast<std::size_t>(size_)] = index;
    weights_(size_) = size_ == 0 ? 1.0 : 0.0;
    ++size_;
  }

  [[nodiscard]] Eigen::Vector3d point() const {
    Eigen::Vector3d sum = weights_(0) * points_.col(0);
    for (Eigen::Index i = 1; i < size_; ++i) sum += weights_(i) * points_.col(i);
    return sum;
  }

  // Moves to the point of least norm in the hull and drops the points not needed for it. False if
  // rounding makes the problem degenerate.
  bool settle() {
    for (;;) {
      const Eigen::Vector4d affine = least_norm();
      bool inside = true;
      for (Eigen::Index i = 0; i < size_; ++i) inside = inside && affine(i) > kMinNorm;
      if (inside) {
        weights_ = affine;
        return true;
      }
      if (!affine.allFinite()) return false;
      double step = 1.0;
      for (Eigen::Index i = 0; i < size_; ++i) {
        if (affine(i) <= kMinNorm) step = std::min(step, weights_(i) / (weights_(i) - affine(i)));
      }
      weights_ += step * (affine - weights_);
      drop();
    }
  }

 private:
  static constexpr double kMinNorm = 1e-12;
  static constexpr double kFlat = 1e-20;  ///< Squared sine below which an angle counts as zero.

  // Weights of the point of least norm: sum one, any sign; not finite if the points are not
  // affinely independent. Computed with orthogonal edges, not the normal equations, which would
  // square the ratio of the longest edge to the shortest: perhaps kilometres to centimetres.
  [[nodiscard]] Eigen::Vector4d least_norm() const {
    switch (size_) {
      case 1:
        return Eigen::Vector4d::Unit(0);
      case 2:
        return least_norm_on_line();
      default:
        return least_norm_from_corner();
    }
  }

  [[nodiscard]] Eigen::Vector4d least_norm_on_line() const {
    const Eigen::Vector3d edge = points_.col(1) - points_.col(0);
    const double y = -edge.dot(points_.col(0)) / edge.squaredNorm();
    return {1.0 - y, y, 0.0, 0.0};
  }

  // Least-norm weights for three points, or for four with the newest last. Edges of the first three
  // start at the corner opposite their longest side, where they are the least parallel.
  [[nodiscard]] Eigen::Vector4d least_norm_from_corner() const {
    const auto [corner, nearer, farther] = by_opposite_side();
    const Eigen::Vector3d along = points_.col(farther) - points_.col(corner);
    const Eigen::Vector3d across = points_.col(nearer) - points_.col(corner);
    Eigen::Vector3d to_origin = -points_.col(corner);
    double last = 0.0;
    if (size_ == 4) {
      const Eigen::Vector3d normal = along.cross(across);
      const Eigen::Vector3d edge = points_.col(3) - points_.col(corner);
      const double height = normal.dot(edge);
      if (!(height * height > kFlat * normal.squaredNorm() * edge.squaredNorm())) return none();
      last = normal.dot(to_origin) / height;
      to_origin -= last * edge;
    }
    const double per_squared = 1.0 / along.squaredNorm();
    const double across_along = along.dot(across) * per_squared;
    const double origin_along = along.dot(to_origin) * per_squared;
    const Eigen::Vector3d square = across - across_along * along;
    if (!(square.squaredNorm() > kFlat * across.squaredNorm())) return none();
    Eigen::Vector4d weights = Eigen::Vector4d::Zero();
    weights(3) = last;
    weights(nearer) = square.dot(to_origin - origin_along * along) / square.squaredNorm();
    weights(farther) = origin_along - weights(nearer) * across_along;
    weights(corner) = 1.0 - weights(nearer) - weights(farther) - last;
    return weights;
  }

  // The first three points, ordered by their opposite sides, longest first: from the first of them,
  // the edge to the second is shorter than that to the third.
  [[nodiscard]] std::array<Eigen::Index, 3> by_opposite_side() const {
    const Eigen::Vector3d side((points_.col(1) - points_.col(2)).squaredNorm(),
                               (points_.col(2) - points_.col(0)).squaredNorm(),
                               (points_.col(0) - points_.col(1)).squaredNorm());
    std::array<Eigen::Index, 3> order{0, 1, 2};
    if (side(order[1]) > side(order[0])) std::swap(order[0], order[1]);
    if (side(order[2]) > side(order[0])) std::swap(order[0], order[2]);
    if (side(order[2]) > side(order[1])) std::swap(order[1], order[2]);
    return order;
  }

  [[nodiscard]] static Eigen::Vector4d none() {
    return Eigen::Vector4d::Constant(std::numeric_limits<double>::quiet_NaN());
  }

  void drop() {
    Eigen::Index kept = 0;
    Eigen::Index least = 0;
    weights_.head(size_).minCoeff(&least);
    for (Eigen::Index i = 0; i < size_; ++i) {
      if (i == least || weights_(i) <= kMinNorm) continue;
      points_.col(kept) = points_.col(i).eval();
      indices_[static_cast<std::size_t>(kept)] = indices_[static_cast<std::size_t>(i)];
      weights_(kept++) = weights_(i);
    }
    size_ = kept > 0 ? kept : 1;
    weights_.head(size_) /= weights_.head(size_).sum();
  }

  Eigen::Matrix<double, 3, 4> points_;
  Eigen::Vector4d weights_ = Eigen::Vector4d::Zero();
  std::array<std::size_t, 4> indices_{};
  Eigen::Index size_ = 0;
};

}  // namespace dive::planning
