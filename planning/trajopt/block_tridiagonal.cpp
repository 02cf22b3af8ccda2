#include "planning/trajopt/block_tridiagonal.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"

namespace dive::planning {
namespace {

// The kernels are plain loops over columns: with six rows known at compile time the compiler turns
// each inner loop into a few vector instructions; a general triangular solver would branch.

bool cholesky(Matrix6d& a) {
  for (int j = 0; j < 6; ++j) {
    for (int k = 0; k < j; ++k) {
      const double factor = a(j, k);
      for (int r = j; r < 6; ++r) a(r, j) -= factor * a(r, k);
    }
    if (!(a(j, j) > 0.0)) return false;  // also NaN
    const double reciprocal = 1.0 / std::sqrt(a(j, j));
    for (int r = j + 1; r < 6; ++r) a(r, j) *= reciprocal;
    a(j, j) = reciprocal;
  }
  return true;
}

/// e := e L^-T.
void solve_from_the_right(const Matrix6d& L, Matrix6d& e) {
  for (int j = 0; j < 6; ++j) {
    for (int k = 0; k < j; ++k) e.col(j) -= L(j, k) * e.col(k);
    e.col(j) *= L(j, j);
  }
}

/// a := a - e e^T.
void subtract_square(const Matrix6d& e, Matrix6d& a) {
  for (int j = 0; j < 6; ++j) {
    Vector6d column = a.col(j);
    for (int k = 0; k < 6; ++k) column -= e(j, k) * e.col(k);
    a.col(j) = column;
  }
}

/// b := L^-1 b.
void forward(const Matrix6d& L, Vector6d& b) {
  for (int j = 0; j < 6; ++j) {
    b(j) *= L(j, j);
    for (int r = j + 1; r < 6; ++r) b(r) -= L(r, j) * b(j);
  }
}

/// b := L^-T b.
void backward(const Matrix6d& L, Vector6d& b) {
  for (int j = 5; j >= 0; --j) {
    for (int r = j + 1; r < 6; ++r) b(j) -= L(r, j) * b(r);
    b(j) *= L(j, j);
  }
}

}  // namespace

BlockTridiagonal::BlockTridiagonal(int max_blocks)
    : diagonal_(static_cast<std::size_t>(max_blocks)),
      lower_(static_cast<std::size_t>(max_blocks)) {
  DIVE_DEMAND(max_blocks > 0);
}

void BlockTridiagonal::set_zero(int blocks) {
  DIVE_DEMAND(blocks > 0 && static_cast<std::size_t>(blocks) <= diagonal_.size());
  blocks_ = blocks;
  std::fill_n(diagonal_.begin(), blocks, Matrix6d::Zero());
  std::fill_n(lower_.begin(), blocks, Matrix6d::Zero());
}

bool BlockTridiagonal::factorise() {
  for (int i = 0; i < blocks_; ++i) {
    if (!cholesky(diagonal(i))) return false;
    if (i + 1 == blocks_) break;
    solve_from_the_right(diagonal(i), lower(i));
    subtract_square(lower(i), diagonal(i + 1));
  }
  return true;
}

void BlockTridiagonal::solve(std::span<Vector6d> b) const {
  DIVE_DEMAND(b.size() >= static_cast<std::size_t>(blocks_));
  for (int i = 0; i < blocks_; ++i) {
    Vector6d& block = b[static_cast<std::size_t>(i)];
    if (i > 0) block.noalias() -= lower(i - 1) * b[static_cast<std::size_t>(i) - 1];
    forward(diagonal(i), block);
  }
  for (int i = blocks_ - 1; i >= 0; --i) {
    Vector6d& block = b[static_cast<std::size_t>(i)];
    if (i + 1 < blocks_) {
      block.noalias() -= lower(i).transpose() * b[static_cast<std::size_t>(i) + 1];
    }
    backward(diagonal(i), block);
  }
}

}  // namespace dive::planning
