#pragma once
// Positions in the right image of features of the left one. A feature of known depth is searched
// from its predicted position; another first along its epipolar line, by normalised
// cross-correlation on the half-size images over all depths. Then KLT forward and back, and the
// epipolar constraint.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "estimation/visual_inertial/front_end/klt.h"

namespace dive::estimation {

struct StereoOptions {
  double min_depth_m = 0.25;   ///< Minimum depth of a match.
  double max_depth_m = 100.0;  ///< Depths beyond it count as infinite.
  double back_px = 1.0;        ///< Maximum error of a point tracked to the right and back.
  double epipolar_px = 1.5;    ///< Maximum distance of a match from its epipolar line.

  /// A description of the first error; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
};

struct StereoQuery {
  Eigen::Vector2f pixel;                               ///< Position in the left image.
  Eigen::Vector2d left;                                ///< The same position, normalised.
  std::optional<double> inverse_depth = std::nullopt;  ///< 1/m, along z of the left camera.
};

struct StereoMatch {
  Eigen::Vector2d right;  ///< Position in the right image, normalised.
  double inverse_depth;   ///< 1/m, along z of the left camera; 0 beyond the maximum depth.
};

/// An image as Klt needs it, and the same at half the size, by halve().
struct ImagePair {
  const KltImage& full;
  GrayView half;
};

class StereoMatcher {
 public:
  static constexpr double kMinBaseline_m = 1e-3;  ///< Minimum distance of the two cameras.
  static constexpr int kLevels = 1;               ///< Of the pyramids: the guess is good.

  /// Demands options and cameras that validate, of one size, at least that distance apart.
  StereoMatcher(StereoOptions options, const CameraModel& left, const CameraModel& right,
                int window_px);

  /// The match of each query, if there is one. An error is an exception of OpenCV or ViSP.
  [[nodiscard]] tl::expected<std::vector<std::optional<StereoMatch>>, std::string> match(
      const ImagePair& left, const ImagePair& right, const std::vector<StereoQuery>& queries);

 private:
  [[nodiscard]] std::optional<Eigen::Vector2d> right_pixel(const Eigen::Vector2d& left,
                                                           double inverse_depth) const;
  [[nodiscard]] std::optional<Eigen::Vector2f> search(const ImagePair& left, const ImagePair& right,
                                                      const StereoQuery& query) const;
  [[nodiscard]] std::optional<StereoMatch> accepted(const StereoQuery& query,
                                                    const Eigen::Vector2f& found) const;

  StereoOptions options_;
  CameraModel right_;
  Eigen::Matrix3d R_RL_;
  Eigen::Vector3d p_RL_;
  Klt klt_;
};

}  // namespace dive::estimation
