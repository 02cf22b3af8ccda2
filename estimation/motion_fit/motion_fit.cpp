#include "estimation/motion_fit/motion_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/motion_fit/fit_system.h"

namespace dive::estimation {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kMaxLogStep = 0.5;
constexpr double kConverged = 1e-6;  // of the relative reduction of the cost
constexpr double kMaxDamping = 1e8;
constexpr double kMad = 1.4826;  // of a median of absolute values, to a standard deviation
constexpr std::size_t kBuoyancy = 11;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Fitter {
 public:
  Fitter(std::span<const MotionRecord> records, const MotionModel& before,
         const MotionFitOptions& options)
      : options_(options), before_(before) {
    state_.model = before;
    state_.dives.resize(records.size());
    for (const MotionRecord& record : records) ticks_.push_back(driven_ticks(record));
    for (std::size_t dive = 0; dive < records.size(); ++dive) {
      for (MotionWindow& window : windows_of(records[dive], ticks_[dive], dive, options.windows)) {
        windows_.push_back(std::move(window));
      }
    }
    for (const MotionWindow& window : windows_) {
      problems_.emplace_back(window, ticks_[window.dive]);
      state_.windows.push_back(problems_.back().guess());
    }
    free_.resize(kEquationCoefficients);
    std::iota(free_.begin(), free_.end(), 0);
    for (std::size_t i = 0; i < kEquationCoefficients; ++i) {
      is_log_[i] = i != kBuoyancy && motion_coefficients()[i].value(before) > 0.0;
    }
  }

  [[nodiscard]] std::size_t windows() const { return windows_.size(); }
  [[nodiscard]] std::size_t unknowns() const {
    return free_.size() + kDiveUnknowns * state_.dives.size();
  }

  MotionFit fit() {
    minimise();
    scale_ = std::max(1.0, typical_residual());
    minimise();
    keep_open_coefficients();
    scale_ = std::max(1.0, typical_residual());
    minimise();
    return result();
  }

 private:
  struct State {
    MotionModel model;
    std::vector<DiveUnknowns> dives;
    std::vector<WindowUnknowns> windows;
  };

  [[nodiscard]] double prior_sigma(int index) const {
    const auto i = static_cast<std::size_t>(index);
    if (i == kBuoyancy) return options_.buoyancy_sigma;
    return is_log_[i] ? options_.prior_sigma : 0.2;
  }

  // Difference from the prior, in the units of prior_sigma().
  [[nodiscard]] double off_prior(const MotionModel& model, int index) const {
    const auto i = static_cast<std::size_t>(index);
    const MotionCoefficient& c = motion_coefficients()[i];
    return is_log_[i] ? std::log(c.value(model) / c.value(before_))
                      : c.value(model) - c.value(before_);
  }

  // Huber's loss: quadratic up to the bound, linear beyond.
  [[nodiscard]] double bound() const { return options_.huber * scale_; }
  [[nodiscard]] double loss(double r) const {
    const double size = std::abs(r);
    return size <= bound() ? 0.5 * r * r : bound() * (size - 0.5 * bound());
  }

  [[nodiscard]] double cost(const State& state) const {
    double sum = 0.0;
    for (std::size_t w = 0; w < problems_.size(); ++w) {
      const VectorXd r =
          problems_[w].residuals(state.model, state.dives[windows_[w].dive], state.windows[w]);
      for (Index i = 0; i < r.size(); ++i) sum += loss(r[i]);
    }
    for (const int i : free_) {
      sum += 0.5 * std::pow(off_prior(state.model, i) / prior_sigma(i), 2);
    }
    for (const DiveUnknowns& dive : state.dives) {
      sum += 0.5 * dive.current_W.squaredNorm() / std::pow(options_.current_sigma, 2);
      sum += 0.5 * std::pow(dive.speed_error / options_.speed_sigma, 2);
    }
    return sum;
  }

  [[nodiscard]] FitSystem system() const {
    FitSystem system(free_.size(), state_.dives.size());
    for (std::size_t w = 0; w < problems_.size(); ++w) {
      const std::size_t dive = windows_[w].dive;
      const Residuals residuals =
          problems_[w].linearised(state_.model, state_.dives[dive], state_.windows[w], free_,
                                  std::span<const bool>(is_log_.data(), is_log_.size()));
      const VectorXd weights =
          residuals.r.unaryExpr([&](double r) { return std::min(1.0, bound() / std::abs(r)); });
      system.add(make_system(dive, residuals, weights));
    }
    VectorXd information(system.size());
    VectorXd gradient(system.size());
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const auto at = static_cast<Index>(k);
      information[at] = 1.0 / std::pow(prior_sigma(free_[k]), 2);
      gradient[at] = information[at] * off_prior(state_.model, free_[k]);
    }
    const double current = 1.0 / std::pow(options_.current_sigma, 2);
    const double speed = 1.0 / std::pow(options_.speed_sigma, 2);
    for (std::size_t d = 0; d < state_.dives.size(); ++d) {
      const auto at = static_cast<Index>(free_.size() + kDiveUnknowns * d);
      information.segment<3>(at) << current, current, speed;
      gradient.segment<2>(at) = current * state_.dives[d].current_W;
      gradient[at + 2] = speed * state_.dives[d].speed_error;
    }
    system.set_prior(std::move(information), std::move(gradient));
    return system;
  }

  [[nodiscard]] State moved_by(const FitStep& step) const {
    State state = state_;
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const auto i = static_cast<std::size_t>(free_[k]);
      const MotionCoefficient& c = motion_coefficients()[i];
      const double by = step.global[static_cast<Index>(k)];
      double& value = c.of(state.model);
      value = is_log_[i] ? value * std::exp(std::clamp(by, -kMaxLogStep, kMaxLogStep)) : value + by;
      value = std::clamp(value, c.low, c.high);
    }
    for (std::size_t d = 0; d < state.dives.size(); ++d) {
      const auto at = static_cast<Index>(free_.size() + kDiveUnknowns * d);
      state.dives[d].current_W += step.global.segment<2>(at);
      state.dives[d].speed_error =
          std::clamp(state.dives[d].speed_error + step.global[at + 2], -0.5, 0.5);
    }
    for (std::size_t w = 0; w < state.windows.size(); ++w) {
      state.windows[w] = moved(state.windows[w], step.windows[w]);
    }
    return state;
  }

  void minimise() {
    double damping = 1e-3;
    double now = cost(state_);
    converged_ = false;
    for (int i = 0; i < options_.max_iterations && !converged_; ++i) {
      ++iterations_;
      const FitSystem linear = system();
      while (true) {
        State next = moved_by(linear.solve(damping));
        const double then = cost(next);
        if (then < now) {
          converged_ = now - then < kConverged * now;
          state_ = std::move(next);
          now = then;
          damping = std::max(0.1 * damping, 1e-9);
          break;
        }
        damping *= 10.0;
        if (damping > kMaxDamping) {
          converged_ = true;  // no step in any direction reduces the cost
          break;
        }
      }
    }
  }

  [[nodiscard]] double typical_residual() const {
    std::vector<double> sizes;
    for (std::size_t w = 0; w < problems_.size(); ++w) {
      const VectorXd r =
          problems_[w].residuals(state_.model, state_.dives[windows_[w].dive], state_.windows[w]);
      for (Index i = 0; i < r.size(); ++i) sizes.push_back(std::abs(r[i]));
    }
    return kMad * median(std::move(sizes));
  }

  [[nodiscard]] VectorXd sigmas() const {
    return system().covariance().diagonal().cwiseMax(0.0).cwiseSqrt();
  }

  void keep_open_coefficients() {
    const VectorXd sigma = sigmas();
    std::vector<int> constrained;
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const double share = sigma[static_cast<Index>(k)] / prior_sigma(free_[k]);
      if (share < options_.max_open_share) {
        constrained.push_back(free_[k]);
      } else {
        const MotionCoefficient& c = motion_coefficients()[static_cast<std::size_t>(free_[k])];
        c.of(state_.model) = c.value(before_);
      }
    }
    free_ = std::move(constrained);
  }

  [[nodiscard]] MotionFit result() const {
    MotionFit fit;
    fit.model = state_.model;
    for (std::size_t i = 0; i < kEquationCoefficients; ++i) {
      const double value = motion_coefficients()[i].value(before_);
      fit.coefficients.push_back({value, value, 0.0, false});
    }
    const VectorXd sigma = sigmas();
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const auto i = static_cast<std::size_t>(free_[k]);
      FittedCoefficient& c = fit.coefficients[i];
      c.value = motion_coefficients()[i].value(state_.model);
      c.sigma = sigma[static_cast<Index>(k)] * (is_log_[i] ? c.value : 1.0);
      c.is_constrained = true;
    }
    fit.windows = static_cast<int>(windows_.size());
    fit.iterations = iterations_;
    fit.converged = converged_;
    fit.residual = typical_residual();
    return fit;
  }

  const MotionFitOptions options_;
  const MotionModel before_;
  std::vector<std::vector<DrivenTick>> ticks_;
  std::vector<MotionWindow> windows_;
  std::vector<WindowProblem> problems_;
  std::vector<int> free_;
  std::array<bool, kEquationCoefficients> is_log_{};
  State state_;
  double scale_ = 1e6;  // of the residuals: at first all count as they are
  int iterations_ = 0;
  bool converged_ = false;
};

}  // namespace

std::string MotionFitOptions::validate() const {
  RangeCheck check;
  check("length_s", windows.length_s, 2.0, 120.0);
  check("min_depth_m", windows.min_depth_m, 0.0, 100.0);
  check("min_fixes", static_cast<double>(windows.min_fixes), 2.0, 1000.0);
  check("prior_sigma", prior_sigma, 1e-3, 10.0);
  check("buoyancy_sigma", buoyancy_sigma, 1e-6, 1.0);
  check("max_open_share", max_open_share, 0.01, 1.0);
  check("current_sigma", current_sigma, 1e-6, 5.0);
  check("speed_sigma", speed_sigma, 1e-6, 1.0);
  check("huber", huber, 0.5, 1e6);
  check("max_iterations", max_iterations, 1, 10'000);
  return check.problem();
}

tl::expected<MotionFit, std::string> fit_motion(std::span<const MotionRecord> records,
                                                const MotionModel& before,
                                                const MotionFitOptions& options) {
  DIVE_DEMAND(options.validate().empty() && before.validate().empty());
  Fitter fitter(records, before, options);
  if (fitter.windows() <= fitter.unknowns()) {
    return tl::unexpected(fmt::format(
        "too little to fit: {} windows of {:g} s between fixes, and {} unknowns; record {} s more",
        fitter.windows(), options.windows.length_s, fitter.unknowns(),
        static_cast<double>(fitter.unknowns() + 1 - fitter.windows()) * options.windows.length_s));
  }
  return fitter.fit();
}

}  // namespace dive::estimation
