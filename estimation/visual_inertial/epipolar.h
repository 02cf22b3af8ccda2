#pragma once
// Which features move as a world that stands still would, given how the camera has turned. Between
// two pictures with the rotation R known, a point at b = R [n0, 1] before and f = [n1, 1] now obeys
//
//   t . (b x f) = 0,   -(t x f) . (b x f) > 0
//
// for the one translation t of the camera (p_C1 = R p_C0 + t): the epipolar constraint, and that it
// lies before the camera. Two points give t: RANSAC with a sample of two (Fischler and Bolles 1981;
// known rotation as in Troiani et al., "2-point-based outlier rejection for camera-IMU systems",
// 2014), scored as MSAC does. What drifts on its own way, snow before all, disagrees.

#include <vector>

#include <Eigen/Core>

#include "common/random.h"

namespace dive::estimation {

/// One feature in two pictures, in normalised image coordinates.
struct TurnedMatch {
  Eigen::Vector3d before;  ///< R [n0, 1], divided by its z: in the camera as it is now.
  Eigen::Vector2d now;     ///< n1
};

/// For each match whether it agrees, to `tolerance` (normalised: pixels over focal length). One
/// that has not moved by more than the tolerance agrees with everything.
[[nodiscard]] std::vector<bool> agree_with_one_translation(const std::vector<TurnedMatch>& matches,
                                                           double tolerance, Random& random);

}  // namespace dive::estimation
