#pragma once
// Identifies the coefficients of the motion model from recorded dives: nonlinear least squares on
// open-loop predictions over windows of some seconds between fixes.
//
// Levenberg-Marquardt (More 1978) on Eigen's dense solvers. The unknowns of a window (seven:
// position, height, velocity, heading) enter its own residuals only, so they are eliminated from
// the normal equations window by window (Schur complement), which leaves the coefficients and three
// unknowns for each dive: some forty, whatever the number of windows. Eigen's unsupported solvers
// would hold one dense Jacobian of all unknowns; Ceres has this elimination too, but would be a new
// dependency for a system of this size. Large residuals have the weights of Huber's loss.
//
// Standard deviations are those of the sandwich estimate A^-1 (B + P) A^-1 (Liang, Zeger 1986): A
// the reduced normal matrix, P the prior's part of it, B the sum over the windows of the outer
// products of their gradients. Residuals of one window may be correlated, as the errors of a
// prediction are; windows count as independent.

#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/motion_model.h"
#include "estimation/motion_fit/driven_motion.h"
#include "estimation/motion_fit/motion_record.h"

namespace dive::estimation {

struct MotionFitOptions {
  WindowOptions windows;
  double prior_sigma = 0.5;      ///< Relative sigma of each coefficient before the fit.
  double buoyancy_sigma = 0.03;  ///< Sigma of the buoyancy before the fit, m/s^2.
  /// A coefficient whose standard deviation is reduced to no less than this share of that before
  /// the fit is not constrained by the dives: it keeps its value.
  double max_open_share = 0.5;
  double current_sigma = 0.1;  ///< Sigma of a dive's current, per axis, m/s.
  double speed_sigma = 0.05;   ///< Relative sigma of the gait's speed from dive to dive.
  double huber = 3.0;          ///< Standard deviations beyond which a residual counts less.
  int max_iterations = 40;     ///< For each of the three passes.

  /// Empty if usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

struct FittedCoefficient {
  double before = 0.0;
  double value = 0.0;
  double sigma = 0.0;           ///< One standard deviation; 0 if not constrained.
  bool is_constrained = false;  ///< False: the dives do not determine it, and it keeps its value.
};

struct MotionFit {
  MotionModel model;
  std::vector<FittedCoefficient> coefficients;  ///< The first kEquationCoefficients.
  int windows = 0;
  int iterations = 0;
  bool converged = false;
  double residual = 0.0;  ///< Median of the residuals over their expected sigmas, times 1.48.
};

/// Begins with `before`, the coefficients known so far, which are the prior. The error is a
/// sentence: too few windows. Demands options that validate. Deterministic.
[[nodiscard]] tl::expected<MotionFit, std::string> fit_motion(std::span<const MotionRecord> records,
                                                              const MotionModel& before,
                                                              const MotionFitOptions& options);

}  // namespace dive::estimation
