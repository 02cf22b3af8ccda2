#pragma once
// What a feature looked like when it was first seen, and where that is in a later picture: the
// check of Shi and Tomasi ("Good features to track", 1994), by the inverse compositional algorithm
// (Baker and Matthews, "Lucas-Kanade 20 years on", IJCV 2004).
//
// A tracker from picture to picture never looks back: what it errs by adds up, and as a patch grows
// or tilts it errs in one direction. Here the first patch T is laid on the picture I by an affine
// map, both with zero mean and unit variance over the patch:
//
//   min over t, A of sum_x (I(t + A x) - T(x))^2
//
// so that the error of a place stays what one picture's noise makes it, however long the track.

#include <array>
#include <optional>

#include <Eigen/Core>

#include "estimation/visual_inertial/klt.h"

namespace dive::estimation {

/// Where the patch is, and how it is bent.
struct PatchPlace {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();      ///< t
  Eigen::Matrix2f shape = Eigen::Matrix2f::Identity();  ///< A
  float correlation = 1.0F;                             ///< Of both patches, 1 at most.
};

class AnchorPatch {
 public:
  static constexpr int kSide = 16;  ///< Samples of T to a side, 1 px apart.

  /// Around `pixel`; nothing where that is too near to the edge, or there is nothing to hold on to.
  [[nodiscard]] static std::optional<AnchorPatch> cut(const GrayView& picture,
                                                      const Eigen::Vector2f& pixel);
  /// From `guess` on; nothing where it leaves the picture, or goes far, or does not settle in six
  /// steps: what is slow to settle holds on to little.
  [[nodiscard]] std::optional<PatchPlace> find(const GrayView& picture,
                                               const PatchPlace& guess) const;

 private:
  static constexpr int kCount = kSide * kSide;
  using Samples = std::array<float, kCount>;

  static bool sample(const GrayView& picture, const PatchPlace& place, Samples& samples);
  /// To zero mean and unit norm; false where all are alike.
  static bool normalise(Samples& samples);

  Samples patch_;
  Samples by_x_;  // its gradients
  Samples by_y_;
  Eigen::Matrix<float, 6, 6> inverse_;  // of the sum of squared Jacobians
};

}  // namespace dive::estimation
