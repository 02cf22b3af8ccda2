#pragma once
// The first appearance of a feature, located in a later image: the check of Shi and Tomasi ("Good
// features to track", 1994), by the inverse compositional algorithm (Baker and Matthews,
// "Lucas-Kanade 20 years on", IJCV 2004).
//
// A tracker from image to image accumulates errors, and as a patch grows or tilts they have one
// direction. Here the first patch T is aligned with the image I by an affine map, both with zero
// mean and unit variance over the patch:
//
//   min over t, A of sum_x (I(t + A x) - T(x))^2
//
// so that the error of a position stays that of one image's noise, however long the track.

#include <array>
#include <optional>

#include <Eigen/Core>

#include "estimation/visual_inertial/front_end/klt.h"

namespace dive::estimation {

/// Position and affine shape of the patch.
struct PatchPlace {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();      ///< t
  Eigen::Matrix2f shape = Eigen::Matrix2f::Identity();  ///< A
  float correlation = 1.0F;                             ///< Correlation of both patches, at most 1.
};

class AnchorPatch {
 public:
  static constexpr int kSide = 16;  ///< Samples of T per side, 1 px apart.

  /// Cuts the patch around `pixel`; empty if too near to the edge or without texture.
  [[nodiscard]] static std::optional<AnchorPatch> cut(const GrayView& image,
                                                      const Eigen::Vector2f& pixel);
  /// Searches from `guess`; empty if it leaves the image, moves far, or does not converge in six
  /// steps: slow convergence means little texture.
  [[nodiscard]] std::optional<PatchPlace> find(const GrayView& image,
                                               const PatchPlace& guess) const;

 private:
  static constexpr int kCount = kSide * kSide;
  using Samples = std::array<float, kCount>;

  static bool sample(const GrayView& image, const PatchPlace& place, Samples& samples);
  /// Normalises to zero mean and unit norm; false if all samples are equal.
  static bool normalise(Samples& samples);

  Samples patch_;
  Samples by_x_;  // gradients of the patch
  Samples by_y_;
  Eigen::Matrix<float, 6, 6> inverse_;  // inverse of the sum of squared Jacobians
};

}  // namespace dive::estimation
