#pragma once
// How the cameras have moved between two pairs of pictures, by points that both have seen: PnP with
// RANSAC for a beginning (OpenCV), then all image points of both pairs at once by Gauss-Newton, the
// landmarks eliminated (Triggs et al., "Bundle adjustment - a modern synthesis", 2000). What comes
// out is the least squares estimate and its covariance.
//
// Every point is seen by up to four cameras: left and right, then and now. With it in the left
// camera of then, f:
//
//   h_0 = f,   h_1 = R_RL f + p_RL,   h_2 = X^-1 f,   h_3 = R_RL h_2 + p_RL,   z = [h_x/h_z,
//   h_y/h_z]

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "common/se3.h"
#include "estimation/visual_inertial/keyframe.h"

namespace dive::estimation {

struct RelativePoseOptions {
  /// Of an image coordinate, normalised. Where the left camera sees a point now is off by what the
  /// detector errs by, and the right one with it: so that of now is sqrt(2) times the detector's.
  double sigma_then = 0.7 / 240.0;
  double sigma_now = 2.0 / 240.0;
  int fewest = 25;            ///< Points that must agree, ...
  double fewest_share = 0.4;  ///< ... and share of the matches,
  int fewest_cells = 5;       ///< in so many of 4 x 3 parts of what the camera sees now.
  double half_width = 1.6;    ///< Of the picture, normalised: what it sees.
  double half_height = 1.0;
};

struct RelativePose {
  Pose X_C0C1;                             ///< Left camera of now in that of then.
  Matrix6d covariance = Matrix6d::Zero();  ///< Of (p, rotation vector on the right).
  int points = 0;                          ///< That agree.
};

/// `matches` are pairs (then, now). Nothing where too few agree, or in too few parts of the
/// picture. X_RL: the left camera in the right one. Deterministic.
[[nodiscard]] std::optional<RelativePose> relative_pose(
    const PlaceView& then, const PlaceView& now,
    const std::vector<std::pair<std::size_t, std::size_t>>& matches, const Pose& X_RL,
    const RelativePoseOptions& options);

}  // namespace dive::estimation
