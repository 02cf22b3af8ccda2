#pragma once
// A convex quadratic programme whose variables come in blocks of six along a chain, as the
// waypoints of a path do:
//
//     minimise    1/2 x'Hx + g'x + sum_r w_r max(0, b_r - a_r'x)
//     subject to  lower <= x <= upper,   a_r'x >= b_r for the rows of infinite weight,
//
// H symmetric positive semidefinite and block-tridiagonal, every a_r touching two neighbours only.
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
  int block = 0;        ///< Touches x of `block` and, unless that is the last, of `block + 1`.
  Vector12d a;          ///< Coefficients of those two, in this order.
  double b = 0.0;       ///< a'x >= b ...
  double weight = 0.0;  ///< ... or this per unit missing (> 0); kHardRow: it must hold.
};

enum class QpStatus {
  kSolved,
  kIterationLimit,  ///< Hard rows that no x within the bounds satisfies end here.
  kNumericalError,  ///< H is not positive semidefinite, or something is not finite.
};

struct QpOptions {
  int max_iterations = 60;
  double tolerance = 1e-8;  ///< On all residuals, relative to the problem's own scale.
};

/// Largest violation of each optimality condition at the point returned, in the caller's units.
struct QpSummary {
  QpStatus status = QpStatus::kNumericalError;
  int iterations = 0;
  double objective = 0.0;        ///< Hinges included.
  double stationarity = 0.0;     ///< |Hx + g - sum lambda a - z_lower + z_upper|.
  double infeasibility = 0.0;    ///< Of hard rows.
  double complementarity = 0.0;  ///< Sum of multiplier times slack: bounds the gap in objective.
};

/// Workspace and solution. Nothing allocates after construction.
class BandedQp {
 public:
  BandedQp(int max_blocks, int max_rows);

  /// Starts a new problem: H = 0, g = 0, all variables fixed at 0, no rows.
  void reset(int blocks);
  [[nodiscard]] BlockTridiagonal& hessian() { return hessian_; }
  [[nodiscard]] Vector6d& gradient(int block) { return at(block).gradient; }
  /// Finite, lower <= upper; equal ones fix the variable.
  [[nodiscard]] Vector6d& lower(int block) { return at(block).lower; }
  [[nodiscard]] Vector6d& upper(int block) { return at(block).upper; }
  /// Index of the row; rows beyond `max_rows` are refused by assertion.
  int add_row(const QpRow& row);

  [[nodiscard]] QpSummary solve(const QpOptions& options = {});

  [[nodiscard]] const Vector6d& x(int block) const { return at(block).x; }
  /// Multipliers, all >= 0. That of a row is at most its weight.
  [[nodiscard]] const Vector6d& dual_lower(int block) const { return at(block).dual_lower; }
  [[nodiscard]] const Vector6d& dual_upper(int block) const { return at(block).dual_upper; }
  [[nodiscard]] double dual(int row) const { return rows_[static_cast<std::size_t>(row)].lambda; }

 private:
  /// One block of variables. Fixed ones have mask 0, slack 1 and multipliers 0 during the
  /// iterations, so that they need no branches.
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
    bool decided;  ///< Met or missed by every x within the bounds: lambda is 0 or w, the rest 0.
  };
  struct Direction {
    double centring = 0.0;      ///< Target of every product multiplier * slack.
    bool second_order = false;  ///< Subtract the products of the affine direction's changes.
  };

  [[nodiscard]] Block& at(int block) { return blocks_[static_cast<std::size_t>(block)]; }
  [[nodiscard]] const Block& at(int block) const {
    return blocks_[static_cast<std::size_t>(block)];
  }
  [[nodiscard]] double times_row(const Row& row, Vector6d Block::*vector) const;

  /// The most that a'x can change by within the bounds.
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
  double scale_ = 1.0;     ///< Of the objective: the largest change that one variable or row makes.
};

}  // namespace dive::planning
