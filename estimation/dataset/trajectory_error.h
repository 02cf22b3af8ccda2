#pragma once
// How far an estimated trajectory is from the true one (Zhang and Scaramuzza, "A tutorial on
// quantitative trajectory evaluation for visual(-inertial) odometry", 2018). Where an estimator
// cannot know its frame, the estimate is laid on the truth first: by yaw and translation where it
// knows which way is down, by a rigid motion where it does not; never by scale.

#include <optional>
#include <vector>

#include "common/se3.h"
#include "estimation/dataset/trajectory.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/loop_correction.h"

namespace dive::estimation {

struct PosePair {
  Utime utime = 0;
  Pose estimate;
  Pose truth;
};

/// The estimate's poses for which the truth is known, between two true poses at most 0.2 s apart.
[[nodiscard]] std::vector<PosePair> pair_up(const Trajectory& estimate, const Trajectory& truth);

enum class Alignment { kNone, kYawAndTranslation, kRigid };

/// X_TE with the least sum of |X_TE * estimate - truth|^2 over the positions (Umeyama 1991, without
/// scale). Nothing where it is not determined: fewer than three pairs, or all in one place; for a
/// rigid motion also all on one line.
[[nodiscard]] std::optional<Pose> align(const std::vector<PosePair>& pairs, Alignment alignment);

/// Over all pairs, with X_TE applied to the estimate.
struct AbsoluteError {
  double rmse_m = 0.0;  ///< The ATE.
  double max_m = 0.0;
  double rmse_deg = 0.0;  ///< Of the attitude.
};
[[nodiscard]] AbsoluteError absolute_error(const std::vector<PosePair>& pairs, const Pose& X_TE);

/// Over all stretches of the true path of so many metres, each laid on the truth where it begins.
struct RelativeError {
  double distance_m = 0.0;
  int stretches = 0;     ///< 0: the path is too short, and nothing else means anything.
  double mean_m = 0.0;   ///< Of the position at the stretch's end.
  double percent = 0.0;  ///< That, of the distance.
  double mean_deg = 0.0;
};
[[nodiscard]] RelativeError relative_error(const std::vector<PosePair>& pairs, double distance_m);

/// Position at the end, when the trajectories are laid on each other by yaw and translation at the
/// first pair, in percent of the true path's length; 0 for a path shorter than 0.1 m.
[[nodiscard]] double drift_percent(const std::vector<PosePair>& pairs);

/// Normalised estimation error squared, mean over the estimates for which the truth is known: 3
/// each when the covariance is honest. No alignment: the estimator has begun in the truth's frame.
struct Nees {
  int samples = 0;
  double position = 0.0;
  double orientation = 0.0;
};
[[nodiscard]] Nees nees(const std::vector<StateEstimate>& estimates, const Trajectory& truth);

/// Of loops against the truth: by how many metres one puts the later body off, seen from the
/// earlier one. Those for which the truth is known.
[[nodiscard]] std::vector<double> closure_errors(const std::vector<LoopClosure>& closures,
                                                 const Trajectory& truth);

}  // namespace dive::estimation
