#pragma once
// What closed loops say of the filter's poses. A value: made off the critical path, applied on it.

#include <utility>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/se3.h"
#include "estimation/state_estimate.h"

namespace dive::estimation {

/// One place, recognised.
struct LoopClosure {
  Utime utime_old = 0;
  Utime utime_new = 0;
  Pose X_B0B1;                             ///< Body of now in that of then.
  Matrix6d covariance = Matrix6d::Zero();  ///< Of (p, rotation vector on the right).
  int points = 0;                          ///< That agree.
};

/// X_WB = correction * X_WB^f, about the vertical: f is the filter, which is told nothing of it.
struct LoopCorrection {
  LoopClosure closure;  ///< The newest of those that made it.
  int closures = 0;     ///< That it rests on.
  Utime utime = 0;      ///< Of the keyframe that it was made at.
  Pose correction;      ///< From then on.
  Pose filter;          ///< X_WB^f at utime, and its covariance of position and heading,
  Eigen::Matrix4d filter_covariance = Eigen::Matrix4d::Zero();
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< that of the corrected pose.
  bool has_depth = true;
  /// By time: what was seen then and put where the estimates with all corrections before this one
  /// had it, was really there times that.
  std::vector<std::pair<Utime, Pose>> since;

  /// For Mapper::move() and LandmarkCloud::move(), by `since`.
  [[nodiscard]] Pose moved(Utime seen) const;

  /// The filter's estimate of utime or later, corrected. Its covariance: that of the keyframe,
  /// carried on, and what the filter's own has grown or shrunk by since. Of the height, where depth
  /// is measured, no less than the filter's; roll and pitch are the filter's.
  [[nodiscard]] StateEstimate apply(const StateEstimate& filter_now) const;
};

}  // namespace dive::estimation
