#pragma once
// Errors of an estimated trajectory (Zhang and Scaramuzza, "A tutorial on quantitative trajectory
// evaluation for visual(-inertial) odometry", 2018). Where an estimator's frame is unobservable,
// the estimate is first aligned with the truth: by yaw and translation if gravity is observable, by
// a rigid motion if not; never by scale.

#include <optional>
#include <vector>

#include "common/se3.h"
#include "estimation/dataset/trajectory.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/loop_closure/loop_correction.h"

namespace dive::estimation {

struct PosePair {
  Utime utime = 0;
  Pose estimate;
  Pose truth;
};

/// The estimate's poses with a known truth, between two true poses at most 0.2 s apart.
[[nodiscard]] std::vector<PosePair> pair_up(const Trajectory& estimate, const Trajectory& truth);

enum class Alignment { kNone, kYawAndTranslation, kRigid };

/// X_TE with the least sum of |X_TE * estimate - truth|^2 over the positions (Umeyama 1991, without
/// scale). Empty if undetermined: fewer than three pairs, or all at one position; for a rigid
/// motion also all on one line.
[[nodiscard]] std::optional<Pose> align(const std::vector<PosePair>& pairs, Alignment alignment);

/// Errors over all pairs, with X_TE applied to the estimate.
struct AbsoluteError {
  double rmse_m = 0.0;  ///< Absolute trajectory error (ATE).
  double max_m = 0.0;
  double rmse_deg = 0.0;  ///< RMS error of the attitude.
};
[[nodiscard]] AbsoluteError absolute_error(const std::vector<PosePair>& pairs, const Pose& X_TE);

/// Errors over all segments of the true path of one length, each aligned with the truth at its
/// start.
struct RelativeError {
  double distance_m = 0.0;
  int stretches = 0;     ///< Number of segments; 0: path too short, other values invalid.
  double mean_m = 0.0;   ///< Mean position error at the segment's end.
  double percent = 0.0;  ///< Mean position error as a percentage of the distance.
  double mean_deg = 0.0;
};
[[nodiscard]] RelativeError relative_error(const std::vector<PosePair>& pairs, double distance_m);

/// Final position error after alignment by yaw and translation at the first pair, in percent of the
/// true path's length; 0 for a path shorter than 0.1 m.
[[nodiscard]] double drift_percent(const std::vector<PosePair>& pairs);

/// Normalised estimation error squared, mean over the estimates with a known truth: 3 each if the
/// covariance is consistent. No alignment: the estimator was initialised in the truth's frame.
struct Nees {
  int samples = 0;
  double position = 0.0;
  double orientation = 0.0;
};
[[nodiscard]] Nees nees(const std::vector<StateEstimate>& estimates, const Trajectory& truth);

/// Position error of each loop closure, m: of the later body relative to the earlier one, for
/// closures with a known truth.
[[nodiscard]] std::vector<double> closure_errors(const std::vector<LoopClosure>& closures,
                                                 const Trajectory& truth);

}  // namespace dive::estimation
