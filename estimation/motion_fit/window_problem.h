#pragma once
// The least-squares problem of one window: prediction from an initial state against the fixes and
// the depths within it.
//
//   p(t) = p_0 + Rz(c) x(t) + d (t - t_0),   z(t) = z_0 + x_z(t)
//
// with x the motion that estimation/expected_motion.h gives for the coefficients, a thrust of surge
// that is (1 + s)^2 times the nominal one, and the initial velocity v_0. Unknowns of the window:
// p_0 (2), z_0, v_0 (3) and c, the heading correction from the compass to the map. Unknowns of its
// dive: d, the current (2), and s. A fix is a log-likelihood with information A' A, so that its
// residual is A [p - p_fix; c - c_fix] - A^-T gradient.

#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/motion_model.h"
#include "estimation/motion_fit/driven_motion.h"

namespace dive::estimation {

/// What is the same over a dive.
struct DiveUnknowns {
  Eigen::Vector2d current_W = Eigen::Vector2d::Zero();  ///< d, m/s
  double speed_error = 0.0;                             ///< s
};

struct WindowUnknowns {
  Eigen::Vector2d position_W = Eigen::Vector2d::Zero();  ///< p_0, m
  double height = 0.0;                                   ///< z_0, m
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();         ///< v_0, m/s
  double heading_correction = 0.0;                       ///< c, rad
};

/// Order of a window's unknowns in vectors.
inline constexpr int kWindowUnknowns = 7;
inline constexpr int kDiveUnknowns = 3;
using WindowVector = Eigen::Matrix<double, kWindowUnknowns, 1>;

[[nodiscard]] WindowUnknowns moved(const WindowUnknowns& unknowns, const WindowVector& step);

struct Residuals {
  Eigen::VectorXd r;  ///< Weighted: of unit variance if the model is right.
  /// Derivatives by the free coefficients, then by current and speed error.
  Eigen::MatrixXd by_model;
  Eigen::MatrixXd by_window;
};

/// Prediction and residuals of windows of one dive. Keeps references.
class WindowProblem {
 public:
  WindowProblem(const MotionWindow& window, std::span<const DrivenTick> ticks);

  [[nodiscard]] const MotionWindow& window() const { return window_; }
  /// A start from the first fixes, heights and their differences.
  [[nodiscard]] WindowUnknowns guess() const;

  [[nodiscard]] Eigen::VectorXd residuals(const MotionModel& model, const DiveUnknowns& dive,
                                          const WindowUnknowns& unknowns) const;
  /// Also the derivatives by the coefficients `free` (indices in motion_coefficients()), which are
  /// by the logarithm of the value where `is_log`.
  [[nodiscard]] Residuals linearised(const MotionModel& model, const DiveUnknowns& dive,
                                     const WindowUnknowns& unknowns, std::span<const int> free,
                                     std::span<const bool> is_log) const;

 private:
  /// x at the times of the fixes (x and y) and then of the heights (z).
  [[nodiscard]] Eigen::VectorXd motion(const MotionModel& model, double speed_error,
                                       const Eigen::Vector3d& v_B) const;
  [[nodiscard]] Eigen::Vector2d lagged_efforts(double lag_s) const;
  [[nodiscard]] Eigen::VectorXd residuals(const Eigen::VectorXd& motion, const DiveUnknowns& dive,
                                          const WindowUnknowns& unknowns) const;
  [[nodiscard]] double time(Utime utime) const;

  const MotionWindow& window_;
  std::span<const DrivenTick> ticks_;
  std::vector<Eigen::Matrix3d> roots_;      ///< A of each fix.
  std::vector<Eigen::Vector3d> gradients_;  ///< A^-T gradient.
};

}  // namespace dive::estimation
