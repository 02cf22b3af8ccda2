#pragma once
// The normal equations of a fit, with the unknowns of each window eliminated. Private to
// estimation/motion_fit.

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "estimation/motion_fit/window_problem.h"

namespace dive::estimation {

/// Normal equations of one window: model and dive (n + 3) first, then the window.
struct WindowSystem {
  std::size_t dive = 0;
  Eigen::MatrixXd model_model;   ///< (n + 3) x (n + 3)
  Eigen::MatrixXd window_model;  ///< 7 x (n + 3)
  Eigen::Matrix<double, kWindowUnknowns, kWindowUnknowns> window_window;
  Eigen::VectorXd model_gradient;
  WindowVector window_gradient;
};

/// `weights`: of each residual.
[[nodiscard]] WindowSystem make_system(std::size_t dive, const Residuals& residuals,
                                       const Eigen::VectorXd& weights);

/// A step of all unknowns.
struct FitStep {
  Eigen::VectorXd global;  ///< n coefficients, then three for each dive.
  std::vector<WindowVector> windows;
};

class FitSystem {
 public:
  /// `free`: number n of free coefficients.
  FitSystem(std::size_t free, std::size_t dives) : free_(free), dives_(dives) {}

  void add(WindowSystem window) { windows_.push_back(std::move(window)); }
  /// Adds the prior of the global unknowns: its information, and its gradient, per unknown.
  void set_prior(Eigen::VectorXd information, Eigen::VectorXd gradient);

  [[nodiscard]] Eigen::Index size() const {
    return static_cast<Eigen::Index>(free_ + kDiveUnknowns * dives_);
  }
  /// The step that minimises the linearised cost with the diagonal enlarged by `damping`.
  [[nodiscard]] FitStep solve(double damping) const;
  /// The sandwich covariance of the global unknowns.
  [[nodiscard]] Eigen::MatrixXd covariance() const;

 private:
  struct Reduced {
    Eigen::MatrixXd A;
    Eigen::VectorXd g;
  };
  [[nodiscard]] std::vector<Eigen::Index> columns_of(const WindowSystem& window) const;
  [[nodiscard]] Reduced reduced(double damping) const;

  std::size_t free_;
  std::size_t dives_;
  std::vector<WindowSystem> windows_;
  Eigen::VectorXd prior_information_;
  Eigen::VectorXd prior_gradient_;
};

}  // namespace dive::estimation
