#pragma once
// Symmetric block-tridiagonal matrices with 6x6 blocks: one block per waypoint, one coupling per
// pair of neighbours. Everything is O(blocks), and nothing allocates after construction.

#include <span>
#include <vector>

#include "common/se3.h"

namespace dive::planning {

/// diagonal(i) is block (i, i); lower(i) is block (i + 1, i), whose transpose is block (i, i + 1).
class BlockTridiagonal {
 public:
  explicit BlockTridiagonal(int max_blocks);

  /// Sets all of `blocks` (at most max_blocks) blocks to zero.
  void set_zero(int blocks);

  [[nodiscard]] int blocks() const { return blocks_; }
  [[nodiscard]] Matrix6d& diagonal(int i) { return diagonal_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const Matrix6d& diagonal(int i) const {
    return diagonal_[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] Matrix6d& lower(int i) { return lower_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const Matrix6d& lower(int i) const { return lower_[static_cast<std::size_t>(i)]; }

  /// Row `i` of the product with the vector whose blocks are `x(j)`.
  template <typename BlockOf>
  [[nodiscard]] Vector6d multiply_row(int i, const BlockOf& x) const {
    Vector6d product = diagonal(i) * x(i);
    if (i > 0) product.noalias() += lower(i - 1) * x(i - 1);
    if (i + 1 < blocks_) product.noalias() += lower(i).transpose() * x(i + 1);
    return product;
  }

  /// Replaces the matrix by its Cholesky factor (reciprocals on the diagonal). Only the lower
  /// triangles of the diagonal blocks are read. False if it is not positive definite; the content
  /// is then undefined.
  [[nodiscard]] bool factorise();

  /// After factorise(): solves in place for the right-hand side with one block per entry.
  void solve(std::span<Vector6d> b) const;

 private:
  int blocks_ = 0;
  std::vector<Matrix6d> diagonal_;
  std::vector<Matrix6d> lower_;
};

}  // namespace dive::planning
