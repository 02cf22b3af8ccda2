#include "estimation/motion_fit/fit_system.h"

#include <algorithm>
#include <utility>

#include <Eigen/Cholesky>

namespace dive::estimation {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using WindowMatrix = Eigen::Matrix<double, kWindowUnknowns, kWindowUnknowns>;

// Standard deviations before the fit, in the order of WindowUnknowns: weak ones, so that a window
// that does not determine an unknown leaves it where it was.
const WindowVector kWindowSigmas = (WindowVector() << 5.0, 5.0, 5.0, 0.5, 0.5, 0.5, 0.2).finished();

template <typename Matrix>
Matrix damped(Matrix matrix, double damping) {
  matrix.diagonal() *= 1.0 + damping;
  return matrix;
}

}  // namespace

WindowSystem make_system(std::size_t dive, const Residuals& residuals, const VectorXd& weights) {
  const MatrixXd weighted_model = weights.asDiagonal() * residuals.by_model;
  const MatrixXd weighted_window = weights.asDiagonal() * residuals.by_window;
  WindowSystem system;
  system.dive = dive;
  system.model_model = residuals.by_model.transpose() * weighted_model;
  system.window_model = residuals.by_window.transpose() * weighted_model;
  system.window_window = residuals.by_window.transpose() * weighted_window;
  system.window_window.diagonal() += kWindowSigmas.cwiseAbs2().cwiseInverse();
  system.model_gradient = weighted_model.transpose() * residuals.r;
  system.window_gradient = weighted_window.transpose() * residuals.r;
  return system;
}

void FitSystem::set_prior(VectorXd information, VectorXd gradient) {
  prior_information_ = std::move(information);
  prior_gradient_ = std::move(gradient);
}

std::vector<Index> FitSystem::columns_of(const WindowSystem& window) const {
  std::vector<Index> columns;
  columns.reserve(free_ + static_cast<std::size_t>(kDiveUnknowns));
  for (std::size_t i = 0; i < free_; ++i) columns.push_back(static_cast<Index>(i));
  for (int i = 0; i < kDiveUnknowns; ++i) {
    columns.push_back(static_cast<Index>(free_ + kDiveUnknowns * window.dive) + i);
  }
  return columns;
}

FitSystem::Reduced FitSystem::reduced(double damping) const {
  Reduced all{MatrixXd::Zero(size(), size()), VectorXd::Zero(size())};
  for (const WindowSystem& w : windows_) {
    const Eigen::LDLT<WindowMatrix> factor(damped(w.window_window, damping));
    const std::vector<Index> columns = columns_of(w);
    all.A(columns, columns) +=
        damped(w.model_model, damping) - w.window_model.transpose() * factor.solve(w.window_model);
    all.g(columns) +=
        w.model_gradient - w.window_model.transpose() * factor.solve(w.window_gradient);
  }
  all.A.diagonal() += (1.0 + damping) * prior_information_;
  all.g += prior_gradient_;
  return all;
}

FitStep FitSystem::solve(double damping) const {
  const Reduced all = reduced(damping);
  FitStep step;
  step.global = -Eigen::LDLT<MatrixXd>(all.A).solve(all.g);
  for (const WindowSystem& w : windows_) {
    const VectorXd global = step.global(columns_of(w));
    step.windows.push_back(-Eigen::LDLT<WindowMatrix>(damped(w.window_window, damping))
                                .solve(WindowVector(w.window_gradient + w.window_model * global)));
  }
  return step;
}

// The correction for few windows, windows / (windows - unknowns), is that of White's estimate HC1.
MatrixXd FitSystem::covariance() const {
  const MatrixXd A = reduced(0.0).A;
  MatrixXd B = MatrixXd::Zero(size(), size());
  for (const WindowSystem& w : windows_) {
    const Eigen::LDLT<WindowMatrix> factor(w.window_window);
    const VectorXd u =
        w.model_gradient - w.window_model.transpose() * factor.solve(w.window_gradient);
    const std::vector<Index> columns = columns_of(w);
    B(columns, columns) += u * u.transpose();
  }
  const auto windows = static_cast<double>(windows_.size());
  B *= windows / std::max(windows - static_cast<double>(size()), 1.0);
  B.diagonal() += prior_information_;
  const Eigen::LDLT<MatrixXd> factor(A);
  const MatrixXd left = factor.solve(B);
  return factor.solve(left.transpose());
}

}  // namespace dive::estimation
