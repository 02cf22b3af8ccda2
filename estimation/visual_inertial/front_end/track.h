#pragma once
// A feature tracked through the left camera's images. Internal.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include <Eigen/Core>

#include "estimation/visual_inertial/front_end/anchor_patch.h"

namespace dive::estimation {

struct Track {
  static constexpr std::size_t kPast = 16;  ///< Number of past positions stored.

  std::int64_t id = 0;
  Eigen::Vector2f pixel;                            ///< Position in the last image.
  Eigen::Vector2d n;                                ///< The same position, normalised.
  Eigen::Vector2d speed = Eigen::Vector2d::Zero();  ///< Rate of n besides the rotation, 1/s.
  std::optional<Eigen::Vector2d> right;             ///< Position in the right image, normalised.
  std::optional<double> inverse_depth;              ///< Result of its last stereo match, 1/m.
  bool is_new = true;                               ///< True until it is tracked once.
  std::unique_ptr<const AnchorPatch> anchor;        ///< Its first appearance: 3 kB, never moved.
  Eigen::Matrix2f shape = Eigen::Matrix2f::Identity();  ///< Present affine shape of the anchor.
  std::size_t turned = 0;  ///< Number of images with a known rotation over which it was tracked.
  std::array<Eigen::Vector2d, kPast> past;  ///< n, by image number modulo kPast.
};

}  // namespace dive::estimation
