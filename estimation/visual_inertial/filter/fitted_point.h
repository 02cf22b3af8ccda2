#pragma once
// A point of the window's fit (window_fit.h), in inverse depth from the first frame that sees it.
// With h its image there, rho the inverse depth, a the anchor's body, j another frame's body and C
// its camera, all scaled by rho:
//
//   s = R_BA h + rho p_BA,   U = R_j^T (R_a s + rho (p_a - p_j)),   m = R_BC^T (U - rho p_BC)
//
// Internal.

#include <optional>
#include <vector>

#include "common/se3.h"
#include "estimation/visual_inertial/filter/feature_update.h"

namespace dive::estimation {

inline constexpr double kUsualInverseDepth = 0.3;   ///< 1/m
inline constexpr double kInverseDepthSigma = 10.0;  ///< 1/m: hardly a prior

struct FittedPoint {
  std::size_t anchor = 0;                           ///< Frame.
  Eigen::Vector2d image = Eigen::Vector2d::Zero();  ///< Normalised, in the anchor's left camera.
  double inverse_depth = kUsualInverseDepth;        ///< 1/m
};

/// The image of a point in a frame, and its change with all that it depends on. Attitude first.
struct FittedView {
  Eigen::Vector2d image;
  Matrix26d by_anchor;
  Matrix26d by_frame;
  Matrix26d by_anchor_camera;
  Matrix26d by_camera;
  Matrix23d by_point;  ///< Image in the anchor, inverse depth.
};

/// Empty if the point is not in front of the camera. X_BA: the anchor's left camera.
[[nodiscard]] std::optional<FittedView> view_of(const FittedPoint& point, const Kinematics& anchor,
                                                const Kinematics& frame, const Pose& X_BA,
                                                const Pose& X_BC);

/// Poses of the frames and of the cameras in them.
struct FittedPoses {
  const std::vector<Kinematics>& frames;
  const std::vector<Pose>& cameras_B;
};

/// The inverse depth, 0.01 to 5 /m, that fits the track's images best, by Gauss-Newton from the
/// point's. `pixel_sigma`: noise of a pixel coordinate.
[[nodiscard]] double best_inverse_depth(const FeatureTrack& track, const FittedPoses& poses,
                                        const FittedPoint& point, double pixel_sigma);

/// Huber's loss (1964) of an image residual in sigmas, and the weight of its least squares.
struct RobustLoss {
  double cost = 0.0;
  double weight = 1.0;
};
[[nodiscard]] RobustLoss huber(double sigmas);

/// Number of the frame in the window.
[[nodiscard]] inline std::size_t index_of(const TrackObservation& view) {
  return static_cast<std::size_t>(view.frame);
}

/// From a difference of image coordinates to sigmas of a pixel.
[[nodiscard]] inline Eigen::Matrix2d whitening_of(const TrackObservation& view, std::size_t camera,
                                                  double pixel_sigma) {
  return view.to_pixels[camera] / pixel_sigma;
}

[[nodiscard]] inline double weight_of(double sigma) { return 1.0 / (sigma * sigma); }

}  // namespace dive::estimation
