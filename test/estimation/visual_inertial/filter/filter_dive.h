#pragma once
// The filter on an analytic dive: supplies its inputs, and compares it with the truth.

#include <functional>
#include <set>
#include <vector>

#include "estimation/visual_inertial/filter/visual_inertial_filter.h"
#include "test/estimation/visual_inertial/filter/analytic_dive.h"

namespace dive::testing {

struct ErrorSample {
  double t = 0.0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, true - estimated.
  double attitude = 0.0;                               ///< rad
  double nees_position = 0.0;                          ///< NEES of three degrees of freedom.
  double nees_attitude = 0.0;                          ///< NEES of three degrees of freedom.
};

struct FilterDiveResult {
  std::vector<ErrorSample> errors;  ///< Errors once a second.
  double distance_m = 0.0;
  std::vector<double> frame_ms;     ///< Processor time of all calls since the previous frame.
  std::int64_t used = 0;            ///< Number of updates of the state by a landmark.
  std::int64_t used_particles = 0;  ///< Number of those by a moving one.
  std::set<std::int64_t> snow;      ///< All moving objects in front of the camera.
  std::set<std::int64_t> accepted_particles;  ///< Moving objects that ever updated the state.
};

/// The filter's configuration for the dive.
[[nodiscard]] estimation::VisualInertialOptions filter_options(const AnalyticDive& dive,
                                                               const AnalyticDiveOptions& options);
/// The truth at `t`, with errors drawn from the sigmas of `start`; biases as known after a restart.
[[nodiscard]] estimation::KnownStart known_start(const AnalyticDive& dive, double t, Random& random,
                                                 estimation::KnownStart start = {});
[[nodiscard]] ErrorSample compare(const estimation::StateEstimate& estimate,
                                  const DiveTruth& truth);

/// Removes or corrupts inputs; called before each is delivered.
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

/// Runs from `begin` to `end` (s), with an estimate every IMU sample (each 4th at 200 Hz).
[[nodiscard]] FilterDiveResult run(AnalyticDive& dive, const AnalyticDiveOptions& options,
                                   estimation::VisualInertialFilter& filter, double begin,
                                   double end, const Hooks& hooks = {});

}  // namespace dive::testing
