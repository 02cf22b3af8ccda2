#pragma once
// The gyro's bias from the images of a window, whatever the translation: with the rotation R(b) by
// the gyro from one frame to the next, rays f0 and f1 of a static point obey
//
//   t . (f1 x R(b) f0) = 0
//
// with the direction t of the translation (Kneip, Siegwart, Pollefeys, "Finding the exact rotation
// between two images independently of the translation", ECCV 2012). t is the eigenvector of the
// least eigenvalue of the sum of n n^T, n = f1 x R f0, and follows b from iteration to iteration.
// Internal.

#include "estimation/visual_inertial/filter/start_window.h"

namespace dive::estimation {

/// The most likely bias (rad/s) given the images and a prior of sigma `prior_sigma` about `prior`.
[[nodiscard]] Eigen::Vector3d fit_gyro_bias(const StartWindow& window,
                                            const Eigen::Quaterniond& q_BC,
                                            const Eigen::Vector3d& prior, double prior_sigma);

}  // namespace dive::estimation
