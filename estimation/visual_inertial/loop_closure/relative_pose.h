#pragma once
// Motion of the cameras between two image pairs, by the points observed in both: PnP with RANSAC
// for the initial value (OpenCV), then all image points of both pairs at once by Gauss-Newton, the
// landmarks eliminated (Triggs et al., "Bundle adjustment - a modern synthesis", 2000). The result
// is the least-squares estimate and its covariance.
//
// Up to four cameras observe every point: left and right, then and now. With f its position in the
// left camera then:
//
//   h_0 = f,   h_1 = R_RL f + p_RL,   h_2 = X^-1 f,   h_3 = R_RL h_2 + p_RL,
//   z = [h_x/h_z, h_y/h_z]
//
// Residuals are in pixels: those of z multiplied by the camera's d pixel / d z.

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "common/se3.h"
#include "estimation/visual_inertial/loop_closure/keyframe.h"

namespace dive::estimation {

struct RelativePoseOptions {
  std::array<CameraModel, 2> cameras;  ///< Left and right; their poses are not used.
  /// Sigmas of an image coordinate, pixels. The detector's error in the left camera now shifts the
  /// match in the right one as well: so pixels_now is sqrt(2) times the detector's.
  double pixels_then = 0.7;
  double pixels_now = 2.0;
  int min_points = 25;     ///< Minimum number of agreeing points.
  double min_share = 0.4;  ///< Minimum agreeing fraction of the matches.
  int min_cells = 5;       ///< Minimum of 4 x 3 image parts with agreeing points.
};

struct RelativePose {
  Pose X_C0C1;                             ///< Pose of the present left camera in the earlier one.
  Matrix6d covariance = Matrix6d::Zero();  ///< Covariance of (p, rotation vector on the right).
  int points = 0;                          ///< Number of agreeing points.
};

/// `matches` are pairs (then, now). Empty if too few agree, or in too few parts of the image. X_RL:
/// the left camera in the right one. Deterministic.
[[nodiscard]] std::optional<RelativePose> relative_pose(
    const KeyframeView& then, const KeyframeView& now,
    const std::vector<std::pair<std::size_t, std::size_t>>& matches, const Pose& X_RL,
    const RelativePoseOptions& options);

}  // namespace dive::estimation
