#pragma once
// Finds the features that move like a static world under a known rotation of the camera. Between
// two images with the rotation R known, a point at b = R [n0, 1] before and f = [n1, 1] now obeys
//
//   t . (b x f) = 0,   -(t x f) . (b x f) > 0
//
// with the one translation t of the camera (p_C1 = R p_C0 + t): the epipolar constraint, and
// positive depth. Two points give t: RANSAC with a sample of two (Fischler and Bolles 1981; known
// rotation as in Troiani et al., "2-point-based outlier rejection for camera-IMU systems", 2014),
// scored as in MSAC. Features that move on their own, above all marine snow, disagree.
//
// Distances are in pixels: with J = d pixel / d n at the point, the line l.(n - n1) = c is
// |c| / |J^-T l| away.

#include <vector>

#include <Eigen/Core>

#include "common/random.h"

namespace dive::estimation {

/// One feature in two images, in normalised image coordinates.
struct TurnedMatch {
  Eigen::Vector3d before;     ///< R [n0, 1], divided by its z: in the present camera frame.
  Eigen::Vector2d now;        ///< n1
  Eigen::Matrix2d to_pixels;  ///< J: d pixel / d n at n1, invertible.
};

/// For each match, true if it agrees within `tolerance_px`. A match that has moved by no more than
/// the tolerance agrees with everything.
[[nodiscard]] std::vector<bool> agree_with_one_translation(const std::vector<TurnedMatch>& matches,
                                                           double tolerance_px, Random& random);

}  // namespace dive::estimation
