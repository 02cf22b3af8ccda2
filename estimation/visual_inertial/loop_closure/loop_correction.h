#pragma once
// The correction of the filter's poses by closed loops. A value: made off the critical path,
// applied on it.

#include <Eigen/Core>

#include "common/clock.h"
#include "common/map_correction.h"
#include "common/se3.h"
#include "estimation/state_estimate.h"

namespace dive::estimation {

/// One recognised place.
struct LoopClosure {
  Utime utime_old = 0;
  Utime utime_new = 0;
  Pose X_B0B1;                             ///< Pose of the present body in the earlier one.
  Matrix6d covariance = Matrix6d::Zero();  ///< Covariance of (p, rotation vector on the right).
  int points = 0;                          ///< Number of agreeing points.
};

/// X_WB = correction * X_WB^f, about the vertical: f is the filter, which does not receive it.
struct LoopCorrection {
  LoopClosure closure;  ///< The newest of the closures used.
  int closures = 0;     ///< Number of closures used.
  Utime utime = 0;      ///< Time of the keyframe at which it was computed.
  Pose correction;      ///< Correction from then on.
  Pose filter;          ///< X_WB^f at utime; its covariance is filter_covariance.
  Eigen::Matrix4d filter_covariance = Eigen::Matrix4d::Zero();
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< Covariance of the corrected pose.
  bool has_depth = true;
  /// Relative to the positions given by all earlier corrections. Without nodes nothing moves:
  /// `correction` is the earlier one.
  MapCorrection map_correction;

  /// The filter's estimate at utime or later, corrected. Its covariance is that of the keyframe,
  /// propagated, plus the change of the filter's own since. The height's, where depth is measured,
  /// is at least the filter's; roll and pitch are the filter's.
  [[nodiscard]] StateEstimate apply(const StateEstimate& filter_now) const;
};

}  // namespace dive::estimation
