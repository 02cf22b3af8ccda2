#pragma once
// The quadratic programme of banded_qp.h written out densely, and a slow solver of another kind: a
// primal log barrier over x and one epigraph variable per hinge, with dense Newton steps (Boyd and
// Vandenberghe, "Convex Optimization", 11.3). It uses neither multipliers nor bands.

#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "common/random.h"
#include "planning/trajopt/banded_qp.h"

namespace dive::testing {

struct DenseQp {
  Eigen::MatrixXd H;
  Eigen::VectorXd g, lower, upper;
  Eigen::MatrixXd A;
  Eigen::VectorXd b, weight;  ///< Right-hand sides and weights; infinite weight: a hard row.
  std::vector<int> row_block;
  Eigen::VectorXd inside;  ///< A point that satisfies bounds and hard rows with a margin.

  [[nodiscard]] int blocks() const { return static_cast<int>(g.size()) / 6; }
  [[nodiscard]] int rows() const { return static_cast<int>(b.size()); }
  [[nodiscard]] bool is_hard(int r) const { return std::isinf(weight(r)); }

  [[nodiscard]] double objective(const Eigen::VectorXd& x) const {
    double value = 0.5 * x.dot(H * x) + g.dot(x);
    for (int r = 0; r < rows(); ++r) {
      if (!is_hard(r)) value += weight(r) * std::max(0.0, b(r) - A.row(r).dot(x));
    }
    return value;
  }

  void load(planning::BandedQp& qp) const {
    qp.reset(blocks());
    for (int i = 0; i < blocks(); ++i) {
      qp.hessian().diagonal(i) = H.block<6, 6>(6 * i, 6 * i);
      if (i + 1 < blocks()) qp.hessian().lower(i) = H.block<6, 6>(6 * i + 6, 6 * i);
      qp.gradient(i) = g.segment<6>(6 * i);
      qp.lower(i) = lower.segment<6>(6 * i);
      qp.upper(i) = upper.segment<6>(6 * i);
    }
    for (int r = 0; r < rows(); ++r) {
      const int i = row_block[static_cast<std::size_t>(r)];
      planning::QpRow row{.block = i, .a = {}, .b = b(r), .weight = weight(r)};
      row.a.setConstant(1e3);  // must have no effect beyond the last block
      row.a.head<6>() = A.row(r).segment<6>(6 * i).transpose();
      if (i + 1 < blocks()) row.a.tail<6>() = A.row(r).segment<6>(6 * i + 6).transpose();
      qp.add_row(row);
    }
  }
};

struct DenseQpShape {
  int blocks = 4;
  int rows = 8;
  double share_fixed = 0.2;
  double share_hard = 0.2;
};

/// A feasible programme: H is a sum of few squares, so that it is often singular; curvatures,
/// ranges and weights span several orders of magnitude.
inline DenseQp random_qp(const DenseQpShape& shape, Random& random) {
  const int n = 6 * shape.blocks;
  const auto magnitude = [&] { return std::pow(10.0, random.uniform(-2.0, 2.0)); };
  DenseQp qp;
  qp.H = Eigen::MatrixXd::Zero(n, n);
  const auto random_row = [&](int block) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(n);
    const int end = std::min(6 * block + 12, n);
    for (int k = 6 * block; k < end; ++k) row(k) = random.uniform(-1.0, 1.0);
    return row;
  };
  for (int i = 0; i < shape.blocks; ++i) {
    for (int square = 0; square < 4; ++square) {
      const Eigen::VectorXd row = random_row(i);
      qp.H += magnitude() * row * row.transpose();
    }
  }
  qp.g.resize(n);
  qp.lower.resize(n);
  qp.upper.resize(n);
  qp.inside.resize(n);
  for (int k = 0; k < n; ++k) {
    qp.g(k) = 10.0 * random.uniform(-1.0, 1.0);
    const double half = random.uniform() < shape.share_fixed ? 0.0 : random.uniform(0.05, 2.0);
    const double middle = random.uniform(-0.5, 0.5);
    qp.lower(k) = middle - half;
    qp.upper(k) = middle + half;
    qp.inside(k) = middle + half * random.uniform(-0.8, 0.8);
  }
  qp.A = Eigen::MatrixXd::Zero(shape.rows, n);
  qp.b.resize(shape.rows);
  qp.weight.resize(shape.rows);
  for (int r = 0; r < shape.rows; ++r) {
    const int block = static_cast<int>(random.uniform(0.0, shape.blocks));
    qp.row_block.push_back(block);
    qp.A.row(r) = random_row(block).transpose();
    const double at_inside = qp.A.row(r).dot(qp.inside);
    const bool hard = random.uniform() < shape.share_hard;
    qp.weight(r) = hard ? planning::kHardRow : magnitude();
    qp.b(r) = at_inside + (hard ? -random.uniform(0.05, 1.0) : random.uniform(-1.0, 1.0));
  }
  return qp;
}

/// The least objective, to about 1e-7 of `1 + |objective|`.
class BarrierReference {
 public:
  explicit BarrierReference(const DenseQp& qp) : qp_(qp) {
    for (int k = 0; k < qp.g.size(); ++k) {
      if (qp.lower(k) < qp.upper(k)) free_.push_back(k);
    }
    for (int r = 0; r < qp.rows(); ++r) {
      if (!qp.is_hard(r)) soft_.push_back(r);
    }
  }

  /// The result. The arithmetic may fail if rows nearly exclude each other: the value is then only
  /// that of some point.
  struct Least {
    double objective;
    bool is_sure;
  };
  [[nodiscard]] Least least_objective() {
    const auto n = static_cast<Eigen::Index>(free_.size());
    Eigen::VectorXd y(n + static_cast<Eigen::Index>(soft_.size()));
    for (Eigen::Index k = 0; k < n; ++k) y(k) = qp_.inside(free_[static_cast<std::size_t>(k)]);
    for (std::size_t s = 0; s < soft_.size(); ++s) {
      y(n + static_cast<Eigen::Index>(s)) = std::max(0.0, missing(soft_[s], full(y))) + 1.0;
    }
    bool is_sure = true;
    for (double t = 1e-2; t < 1e10; t *= 8.0) is_sure = centre(y, t);
    return {qp_.objective(full(y)), is_sure};
  }

 private:
  /// One inequality c'y + d > 0 of the barrier.
  struct Inequality {
    Eigen::VectorXd c;
    double d;
  };

  [[nodiscard]] Eigen::VectorXd full(const Eigen::VectorXd& y) const {
    Eigen::VectorXd x = qp_.lower;
    for (std::size_t k = 0; k < free_.size(); ++k) x(free_[k]) = y(static_cast<Eigen::Index>(k));
    return x;
  }
  [[nodiscard]] double missing(int r, const Eigen::VectorXd& x) const {
    return qp_.b(r) - qp_.A.row(r).dot(x);
  }

  [[nodiscard]] std::vector<Inequality> inequalities(Eigen::Index size) const {
    std::vector<Inequality> result;
    const auto n = static_cast<Eigen::Index>(free_.size());
    const auto add = [&](const Eigen::VectorXd& c, double d) { result.push_back({c, d}); };
    for (Eigen::Index k = 0; k < n; ++k) {
      const int at = free_[static_cast<std::size_t>(k)];
      add(Eigen::VectorXd::Unit(size, k), -qp_.lower(at));
      add(-Eigen::VectorXd::Unit(size, k), qp_.upper(at));
    }
    Eigen::Index soft = n;
    for (int r = 0; r < qp_.rows(); ++r) {
      Eigen::VectorXd c = Eigen::VectorXd::Zero(size);
      double d = -qp_.b(r);
      for (int k = 0; k < qp_.g.size(); ++k) {
        if (qp_.lower(k) == qp_.upper(k)) d += qp_.A(r, k) * qp_.lower(k);
      }
      for (Eigen::Index k = 0; k < n; ++k) c(k) = qp_.A(r, free_[static_cast<std::size_t>(k)]);
      if (!qp_.is_hard(r)) {
        c(soft) = 1.0;
        add(Eigen::VectorXd::Unit(size, soft++), 0.0);
      }
      add(c, d);
    }
    return result;
  }

  /// Newton's method on t * objective - sum log; false if it does not converge.
  [[nodiscard]] bool centre(Eigen::VectorXd& y, double t) const {
    const auto n = static_cast<Eigen::Index>(free_.size());
    const std::vector<Inequality> all = inequalities(y.size());
    const auto value = [&](const Eigen::VectorXd& at) {
      const Eigen::VectorXd x = full(at);
      double sum = t * (0.5 * x.dot(qp_.H * x) + qp_.g.dot(x));
      for (std::size_t s = 0; s < soft_.size(); ++s) {
        sum += t * qp_.weight(soft_[s]) * at(n + static_cast<Eigen::Index>(s));
      }
      for (const Inequality& i : all) {
        const double room = i.c.dot(at) + i.d;
        if (room <= 0.0) return HUGE_VAL;
        sum -= std::log(room);
      }
      return sum;
    };
    for (int iteration = 0; iteration < 60; ++iteration) {
      const Eigen::VectorXd x = full(y);
      const Eigen::VectorXd slope = qp_.H * x + qp_.g;
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(y.size());
      Eigen::MatrixXd curvature = Eigen::MatrixXd::Zero(y.size(), y.size());
      for (Eigen::Index k = 0; k < n; ++k) {
        gradient(k) = t * slope(free_[static_cast<std::size_t>(k)]);
        for (Eigen::Index j = 0; j < n; ++j) {
          curvature(k, j) =
              t * qp_.H(free_[static_cast<std::size_t>(k)], free_[static_cast<std::size_t>(j)]);
        }
      }
      for (std::size_t s = 0; s < soft_.size(); ++s) {
        gradient(n + static_cast<Eigen::Index>(s)) = t * qp_.weight(soft_[s]);
      }
      for (const Inequality& i : all) {
        const double room = i.c.dot(y) + i.d;
        gradient -= i.c / room;
        curvature += i.c * i.c.transpose() / (room * room);
      }
      const Eigen::VectorXd step = -curvature.ldlt().solve(gradient);
      const double decrement = -gradient.dot(step);
      if (decrement < 1e-9) return true;
      double length = 1.0;
      const double now = value(y);
      while (length > 1e-12 && value(y + length * step) > now + 0.1 * length * gradient.dot(step)) {
        length *= 0.5;
      }
      if (length <= 1e-12) return decrement < 1e-2;  // the limit of rounding
      y += length * step;
    }
    return false;
  }

  const DenseQp& qp_;
  std::vector<int> free_;
  std::vector<int> soft_;
};

}  // namespace dive::testing
