#pragma once
// The filter on an analytic dive: feeds it, and compares it with the truth.

#include <functional>
#include <set>
#include <vector>

#include "estimation/visual_inertial/visual_inertial_filter.h"
#include "test/estimation/visual_inertial/analytic_dive.h"

namespace dive::testing {

struct ErrorSample {
  double t = 0.0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, true - estimated.
  double attitude = 0.0;                               ///< rad
  double nees_position = 0.0;                          ///< Of three degrees of freedom,
  double nees_attitude = 0.0;                          ///< likewise.
};

struct FilterDiveResult {
  std::vector<ErrorSample> errors;  ///< Once a second.
  double distance_m = 0.0;
  std::vector<double> frame_ms;          ///< Processor time of all calls since the frame before.
  std::int64_t used = 0;                 ///< Times that a landmark corrected the state,
  std::int64_t used_snow = 0;            ///< and that one that moves did.
  std::set<std::int64_t> snow;           ///< All that moved before the camera,
  std::set<std::int64_t> believed_snow;  ///< and what of it ever corrected the state.
};

/// What the filter is told of the dive.
[[nodiscard]] estimation::VisualInertialOptions told(const AnalyticDive& dive,
                                                     const AnalyticDiveOptions& options);
/// The truth at `t`, with errors drawn from the sigmas it states.
[[nodiscard]] estimation::KnownStart known_start(const AnalyticDive& dive, double t,
                                                 Random& random);
[[nodiscard]] ErrorSample compare(const estimation::StateEstimate& estimate,
                                  const DiveTruth& truth);

/// What to withhold or spoil; called before each is handed over.
struct Hooks {
  std::function<bool(double t)> has_frame = [](double) { return true; };
  std::function<void(double t, ImuSample&)> spoil_imu = [](double, ImuSample&) {};
  std::function<void(double t, DepthSample&)> spoil_depth = [](double, DepthSample&) {};
  std::function<void(double t, estimation::FeatureFrame&)> spoil_frame =
      [](double, estimation::FeatureFrame&) {};
  std::function<void(double t, estimation::VisualInertialFilter&)> each_tick =
      [](double, estimation::VisualInertialFilter&) {};
  std::function<void(const ErrorSample&)> each_second = [](const ErrorSample&) {};
};

/// From `begin` to `end` (s), from an estimate every IMU sample (each 4th at 200 Hz).
[[nodiscard]] FilterDiveResult run(AnalyticDive& dive, const AnalyticDiveOptions& options,
                                   estimation::VisualInertialFilter& filter, double begin,
                                   double end, const Hooks& hooks = {});

}  // namespace dive::testing
