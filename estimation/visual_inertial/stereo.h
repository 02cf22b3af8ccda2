#pragma once
// Where the features of the left picture are in the right one. A feature of known depth is sought
// from where that puts it; another first along its epipolar line, by normalised cross-correlation
// on the half pictures over all depths. Then KLT there and back, and the epipolar constraint.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "estimation/visual_inertial/klt.h"

namespace dive::estimation {

struct StereoOptions {
  double min_depth_m = 0.25;   ///< Nearer points are not matched.
  double max_depth_m = 100.0;  ///< Farther ones are: as if they were infinitely far.
  double back_px = 1.0;        ///< From left to right and back, a point returns so near.
  double epipolar_px = 1.5;    ///< A match is so near to its epipolar line.

  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
};

struct StereoQuery {
  Eigen::Vector2f pixel;                               ///< In the left picture.
  Eigen::Vector2d left;                                ///< The same, normalised.
  std::optional<double> inverse_depth = std::nullopt;  ///< 1/m, along z of the left camera.
};

struct StereoMatch {
  Eigen::Vector2d right;  ///< Normalised.
  double inverse_depth;   ///< 1/m, along z of the left camera; 0 where it is beyond the maximum.
};

/// A picture and the same at half the size, by halve().
struct PicturePair {
  GrayView full;
  GrayView half;
};

class StereoMatcher {
 public:
  /// Demands options and cameras that validate, of one size, some distance apart.
  StereoMatcher(StereoOptions options, const CameraModel& left, const CameraModel& right,
                int window_px);

  /// For each query its match, if there is one. An error is what OpenCV or ViSP threw.
  [[nodiscard]] tl::expected<std::vector<std::optional<StereoMatch>>, std::string> match(
      const PicturePair& left, const PicturePair& right, const std::vector<StereoQuery>& queries);

 private:
  [[nodiscard]] std::optional<Eigen::Vector2d> right_pixel(const Eigen::Vector2d& left,
                                                           double inverse_depth) const;
  [[nodiscard]] std::optional<Eigen::Vector2f> search(const PicturePair& left,
                                                      const PicturePair& right,
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
