#pragma once
// A convex quadratic programme whose variables form blocks of six along a chain, such as the
// waypoints of a path:
//
//     minimise    1/2 x'Hx + g'x + sum_r w_r max(0, b_r - a_r'x)
//     subject to  lower <= x <= upper,   a_r'x >= b_r for the rows of infinite weight,
//
// H is symmetric positive semidefinite and block-tridiagonal; every a_r involves two neighbours
// only.
//
// Method: primal-dual interior point with Mehrotra's predictor and corrector (Nocedal and Wright,
// "Numerical Optimization", 2nd ed., section 16.6). A hinge is t with a'x + t - s = b, s, t >= 0
// and multiplier 0 <= lambda <= w; its slacks are eliminated by hand, which leaves
//
//     (H + Z_l/S_l + Z_u/S_u + sum_r a_r a_r' / (s_r/lambda_r + t_r/(w_r - lambda_r))) dx = rhs,
//
// block-tridiagonal like H: one Newton step costs O(blocks + rows).

#include <limits>
#include <span>
#include <vector>

#include "planning/trajopt/block_tridiagonal.h"

namespace dive::planning {

using Vector12d = Eigen::Matrix<double, 12, 1>;

inline constexpr double kHardRow = std::numeric_limits<double>::infinity();

struct QpRow {
  /// First block of the row, which involves x of `block` and, unless it is the last, `block + 1`.
  int block = 0;
  Vector12d a;          ///< Coefficients of those two blocks, in this order.
  double b = 0.0;       ///< Right-hand side of a'x >= b.
  double weight = 0.0;  ///< Cost per unit of violation (> 0); kHardRow: no violation allowed.
};

enum class QpStatus {
  kSolved,
  /// Iteration limit reached, also if no x within the bounds satisfies the hard rows.
  kIterationLimit,
  kNumericalError,  ///< H not positive semidefinite, or a value not finite.
};

struct QpOptions {
  int max_iterations = 60;
  double tolerance = 1e-8;  ///< Tolerance of all residuals, relative to the problem's own scale.
};

/// Largest violation of each optimality condition at the point returned, in the caller's units.
struct QpSummary {
  QpStatus status = QpStatus::kNumericalError;
  int iterations = 0;
  double objective = 0.0;      ///< Objective, hinges included.
  double stationarity = 0.0;   ///< |Hx + g - sum lambda a - z_lower + z_upper|.
  double infeasibility = 0.0;  ///< Largest violation of a hard row.
  /// Sum of multiplier times slack, which bounds the gap in objective.
  double complementarity = 0.0;
};

/// Workspace and solution. Allocates only in the constructor.
class BandedQp {
 public:
  BandedQp(int max_blocks, int max_rows);

  /// Starts a new problem: H = 0, g = 0, all variables fixed at 0, no rows.
  void reset(int blocks);
  [[nodiscard]] BlockTridiagonal& hessian() { return hessian_; }
  [[nodiscard]] Vector6d& gradient(int block) { return at(block).gradient; }
  /// Bounds of a block: finite, lower <= upper; equal ones fix the variable.
  [[nodiscard]] Vector6d& lower(int block) { return at(block).lower; }
  [[nodiscard]] Vector6d& upper(int block) { return at(block).upper; }
  /// Adds a row and returns its index; asserts that there are no more than `max_rows`.
  int add_row(const QpRow& row);

  [[nodiscard]] QpSummary solve(const QpOptions& options = {});

  [[nodiscard]] const Vector6d& x(int block) const { return at(block).x; }
  /// Multipliers, all >= 0. A row's multiplier is at most its weight.
  [[nodiscard]] const Vector6d& dual_lower(int block) const { return at(block).dual_lower; }
  [[nodiscard]] const Vector6d& dual_upper(int block) const { return at(block).dual_upper; }
  [[nodiscard]] double dual(int row) const { return rows_[static_cast<std::size_t>(row)].lambda; }

 private:
  /// One block of variables. Fixed variables have mask 0, slack 1 and multipliers 0 during the
  /// iterations, which avoids branches.
  struct Block {
    Vector6d gradient, lower, upper;
    Vector6d x, slack_lower, slack_upper, dual_lower, dual_upper;
    Vector6d dx, ddual_lower, ddual_upper;
    Vector6d mask, residual;
  };
  struct Row {
    QpRow given;
    double s, t, lambda;  ///< a'x + t - s = b; t is 0 for a hard row.
    double ds, dt, dlambda;
    double infeasibility;  ///< a'x + t - s - b.
    double curvature;      ///< 1 / (s / lambda + t / (w - lambda)).
    bool soft;
    /// True if every x within the bounds satisfies or violates the row: lambda is 0 or w, the rest
    /// 0.
    bool decided;
  };
  struct Direction {
    double centring = 0.0;  ///< Target of every product multiplier * slack.
    /// True to subtract the products of the affine direction's changes.
    bool second_order = false;
  };

  [[nodiscard]] Block& at(int block) { return blocks_[static_cast<std::size_t>(block)]; }
  [[nodiscard]] const Block& at(int block) const {
    return blocks_[static_cast<std::size_t>(block)];
  }
  [[nodiscard]] double times_row(const Row& row, Vector6d Block::*vector) const;

  /// Largest change of a'x within the bounds.
  [[nodiscard]] double row_reach(const Row& row) const;

  void initialise();
  void initialise_blocks();
  void initialise_row(Row& row);
  void update_residuals();
  [[nodiscard]] double complementarity() const;
  [[nodiscard]] bool converged(double tolerance) const;
  [[nodiscard]] bool factorise();
  void find_direction(const Direction& direction);
  void direction_of_blocks();
  void direction_of_rows();
  [[nodiscard]] double longest_step() const;
  [[nodiscard]] double complementarity_after(double step) const;
  void move(double step);
  [[nodiscard]] bool iterate();
  [[nodiscard]] QpSummary summarise(QpStatus status, int iterations);

  int block_count_ = 0;
  std::vector<Block> blocks_;
  std::vector<Row> rows_;
  std::size_t max_rows_;
  BlockTridiagonal hessian_;
  BlockTridiagonal newton_;
  std::vector<Vector6d> rhs_;
  double products_ = 0.0;  ///< Number of complementarity products.
  /// Scale of the objective: the largest change that one variable or row makes.
  double scale_ = 1.0;
};

}  // namespace dive::planning
