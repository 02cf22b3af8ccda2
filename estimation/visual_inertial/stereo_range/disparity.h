#pragma once
// A disparity to a fraction of a pixel with its sigma: Lucas and Kanade's least squares along the
// row (1981). Over the window W around a pixel of the left image,
//
//   e = L(u, v) - R(u - d, v),   g = dL/du,   both without their means
//   delta = - sum e g / G,   var d = s^2 / G,   s^2 = sum e^2 / n,   G = sum g^2 - n s^2 / 4
//
// The last term is the contribution of noise of variance s^2 / 2 in L to the sum of squared
// gradients: water without texture has gradients of noise, which must not count as texture.

#include <optional>

#include "estimation/visual_inertial/front_end/klt.h"

namespace dive::estimation {

struct Disparity {
  double px = 0.0;
  double sigma_px = 0.0;  ///< One sigma from the residual noise in the window.
};

inline constexpr int kDisparityWindowWidth = 16;  ///< Pixels: u - 8 to u + 7.
inline constexpr int kDisparityWindowHeight = 9;  ///< Pixels: v - 4 to v + 4.

/// Refines from `start` (px), in rectified images of one size. Empty if the window or its match
/// leaves an image, if it does not converge within 1.5 px, if the windows are no more similar than
/// noise, or if all texture is at one side of the window.
[[nodiscard]] std::optional<Disparity> refine_disparity(const GrayView& left, const GrayView& right,
                                                        int u, int v, double start);

}  // namespace dive::estimation
