#pragma once
// `dive fit` without its files: fits the motion model to dives, and measures it on dives that it
// was not fitted to.

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "estimation/motion_fit/motion_fit.h"
#include "estimation/motion_fit/open_loop.h"

namespace dive::mission {

/// Open-loop error over one horizon with the model before and after the fit, on the same dives.
struct HorizonErrors {
  estimation::OpenLoopError before;
  estimation::OpenLoopError after;
};

struct FitReport {
  estimation::MotionFit fit;  ///< Its model has the measured slip.
  /// Slip measured along x, y and z of B, m/s; an axis without one keeps that of before.
  std::array<std::optional<double>, 3> slip = {};
  bool leaves_one_out = false;  ///< True: each dive was predicted by a fit to all others.
  std::vector<HorizonErrors> errors;

  /// True if the median error over the first horizon is smaller than before.
  [[nodiscard]] bool is_better() const;
};

/// Horizons of the errors, s.
inline constexpr std::array<double, 2> kFitHorizons_s{10.0, 30.0};
/// Least slip that a description gets, m/s: dives to come are not quite those of the fit.
inline constexpr double kMinSlip = 0.01;

using FitObserver = std::function<void(const std::string& step, double share)>;

/// `progress` is called before each step, with the step and the share of the work that is done.
/// Without `held_out` each dive is predicted by a fit to the others. The error is a sentence: too
/// little to fit. Demands one dive or more, and two without `held_out`.
[[nodiscard]] tl::expected<FitReport, std::string> fit_dives(
    std::span<const estimation::MotionRecord> dives,
    std::span<const estimation::MotionRecord> held_out, const MotionModel& before,
    const estimation::MotionFitOptions& options, const FitObserver& progress);

}  // namespace dive::mission
