// The banded factorisation against Eigen's dense one.

#include "planning/trajopt/block_tridiagonal.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/assert.h"
#include "common/random.h"

namespace dive::planning {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// L L' of a random block bidiagonal L with a diagonal away from zero: every such matrix has this
// form.
MatrixXd random_matrix(int blocks, Random& random) {
  const int n = 6 * blocks;
  MatrixXd L = MatrixXd::Zero(n, n);
  for (int row = 0; row < n; ++row) {
    for (int column = std::max(0, 6 * (row / 6) - 6); column < row; ++column) {
      L(row, column) = random.uniform(-1.0, 1.0);
    }
    L(row, row) = random.uniform(0.5, 2.0);
  }
  return L * L.transpose();
}

void load(const MatrixXd& dense, BlockTridiagonal& matrix) {
  const auto blocks = static_cast<int>(dense.rows() / 6);
  matrix.set_zero(blocks);
  for (int i = 0; i < blocks; ++i) {
    matrix.diagonal(i) = dense.block<6, 6>(6 * i, 6 * i);
    if (i + 1 < blocks) matrix.lower(i) = dense.block<6, 6>(6 * i + 6, 6 * i);
  }
}

std::vector<Vector6d> split(const VectorXd& x) {
  std::vector<Vector6d> blocks;
  for (Eigen::Index k = 0; k < x.size(); k += 6) blocks.emplace_back(x.segment<6>(k));
  return blocks;
}

VectorXd random_vector(int blocks, Random& random) {
  return VectorXd::NullaryExpr(6 * blocks, [&] { return random.uniform(-1.0, 1.0); });
}

TEST(BlockTridiagonal, SolvesAndMultipliesAsTheDenseMatrixDoes) {
  EXPECT_TRUE(rc::check([] {
    const int blocks = *rc::gen::inRange(1, 12);
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    const MatrixXd dense = random_matrix(blocks, random);
    const VectorXd b = random_vector(blocks, random);
    BlockTridiagonal matrix(12);
    load(dense, matrix);
    const std::vector<Vector6d> parts = split(b);
    const VectorXd product = dense * b;
    for (int i = 0; i < blocks; ++i) {
      const Vector6d row =
          matrix.multiply_row(i, [&](int j) { return parts[static_cast<std::size_t>(j)]; });
      RC_ASSERT((row - product.segment<6>(6 * i)).norm() < 1e-12 * (1.0 + product.norm()));
    }

    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (int i = 0; i < blocks; ++i) {  // upper triangles are not read
      matrix.diagonal(i).triangularView<Eigen::StrictlyUpper>().setConstant(nan);
    }
    RC_ASSERT(matrix.factorise());
    std::vector<Vector6d> x = parts;
    matrix.solve(x);
    const VectorXd expected = dense.ldlt().solve(b);
    const VectorXd eigenvalues = dense.selfadjointView<Eigen::Lower>().eigenvalues();
    const double condition = eigenvalues.maxCoeff() / std::max(eigenvalues.minCoeff(), 1e-300);
    for (int i = 0; i < blocks; ++i) {
      const Vector6d difference = x[static_cast<std::size_t>(i)] - expected.segment<6>(6 * i);
      RC_ASSERT(difference.norm() <= 1e-13 * condition * expected.norm());
    }
    VectorXd found(6 * blocks);
    for (int i = 0; i < blocks; ++i) found.segment<6>(6 * i) = x[static_cast<std::size_t>(i)];
    RC_ASSERT((dense * found - b).norm() < 1e-12 * dense.norm() * (1.0 + found.norm()));
  }));
}

TEST(BlockTridiagonal, RefusesWhatIsNotPositiveDefinite) {
  Random random(2);
  const MatrixXd dense = random_matrix(5, random);
  const double smallest = dense.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff();
  ASSERT_GT(smallest, 0.0);
  const auto shifted_by = [&](double shift) {
    BlockTridiagonal matrix(5);
    load(dense - shift * MatrixXd::Identity(30, 30), matrix);
    return matrix.factorise();
  };
  EXPECT_TRUE(shifted_by(0.9 * smallest));
  EXPECT_FALSE(shifted_by(1.1 * smallest));
  EXPECT_FALSE(shifted_by(std::numeric_limits<double>::quiet_NaN()));
}

TEST(BlockTridiagonal, KeepsWithinTheSizeItWasMadeFor) {
  EXPECT_THROW(BlockTridiagonal(0), AssertionFailure);
  BlockTridiagonal matrix(3);
  EXPECT_THROW(matrix.set_zero(4), AssertionFailure);
  EXPECT_THROW(matrix.set_zero(0), AssertionFailure);
  matrix.set_zero(2);
  EXPECT_EQ(matrix.blocks(), 2);
  matrix.diagonal(0).setIdentity();
  matrix.diagonal(1).setIdentity();
  ASSERT_TRUE(matrix.factorise());
  std::vector<Vector6d> short_of_one(1);
  EXPECT_THROW(matrix.solve(short_of_one), AssertionFailure);
}

}  // namespace
}  // namespace dive::planning
