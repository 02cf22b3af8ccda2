#include "planning/world/nearest_in_hull.h"

#include <algorithm>
#include <limits>

#include <Eigen/LU>

namespace dive::planning {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

// Wolfe's corral: affinely independent points whose hull holds the current one inside it.
class Corral {
 public:
  explicit Corral(const Vector3d& v) { add(v); }

  [[nodiscard]] bool full() const { return size_ == 4; }
  void add(const Vector3d& v) {
    points_.col(size_) = v;
    weights_(size_) = size_ == 0 ? 1.0 : 0.0;
    ++size_;
  }

  [[nodiscard]] Vector3d point() const { return points_.leftCols(size_) * weights_.head(size_); }

  // Moves to the point of least norm in the hull, dropping what is not needed for it. False when
  // rounding leaves nothing to solve.
  bool settle() {
    for (;;) {
      const Weights affine = least_norm();
      if (!affine.allFinite()) return false;
      if ((affine.array() > kLeast).all()) {
        weights_.head(size_) = affine;
        return true;
      }
      double step = 1.0;
      for (Index i = 0; i < size_; ++i) {
        if (affine(i) <= kLeast) step = std::min(step, weights_(i) / (weights_(i) - affine(i)));
      }
      weights_.head(size_) += step * (affine - weights_.head(size_));
      drop();
    }
  }

 private:
  static constexpr double kLeast = 1e-12;
  static constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
  using Weights = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;

  // Weights that sum to one, of any sign, of the point of least norm; not finite when the points
  // are not affinely independent. Over the edges E from the first point a: E'E y = -E'a.
  template <int Edges>
  [[nodiscard]] Weights least_norm_over() const {
    const Eigen::Matrix<double, 3, Edges> E =
        points_.template middleCols<Edges>(1).colwise() - points_.col(0);
    const Eigen::Matrix<double, Edges, Edges> gram = E.transpose() * E;
    const Eigen::Matrix<double, Edges, 1> y = -(gram.inverse() * (E.transpose() * points_.col(0)));
    Weights weights(Edges + 1);
    weights << 1.0 - y.sum(), y;
    if (!(gram.determinant() > 1e-20 * gram.diagonal().prod())) weights.setConstant(kNotANumber);
    return weights;
  }
  [[nodiscard]] Weights least_norm() const {
    switch (size_) {
      case 1:
        return Weights::Ones(1);
      case 2:
        return least_norm_over<1>();
      case 3:
        return least_norm_over<2>();
      default:
        return least_norm_over<3>();
    }
  }

  void drop() {
    Index kept = 0;
    Index least = 0;
    weights_.head(size_).minCoeff(&least);
    for (Index i = 0; i < size_; ++i) {
      if (i == least || weights_(i) <= kLeast) continue;
      points_.col(kept) = points_.col(i).eval();
      weights_(kept++) = weights_(i);
    }
    size_ = std::max<Index>(kept, 1);
    weights_.head(size_) /= weights_.head(size_).sum();
  }

  Eigen::Matrix<double, 3, 4> points_;
  Eigen::Vector4d weights_;
  Index size_ = 0;
};

}  // namespace

Vector3d nearest_in_hull(std::span<const Vector3d> points, const Vector3d& p) {
  const auto farthest_along = [&](const Vector3d& n) {
    std::size_t best = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (const double along = n.dot(points[i]); along > most) {
        most = along;
        best = i;
      }
    }
    return best;
  };
  const auto nearest = std::ranges::min_element(
      points, {}, [&](const Vector3d& v) { return (v - p).squaredNorm(); });
  Vector3d x = *nearest - p;
  Corral corral(x);
  for (int round = 0; round < 100; ++round) {
    const Vector3d v = points[farthest_along(-x)] - p;
    if (x.squaredNorm() - x.dot(v) <= 1e-14 * (1.0 + v.squaredNorm()) || corral.full()) break;
    corral.add(v);
    if (!corral.settle()) break;
    const Vector3d next = corral.point();
    if (next.squaredNorm() >= x.squaredNorm()) break;
    x = next;
  }
  return p + x;
}

}  // namespace dive::planning
