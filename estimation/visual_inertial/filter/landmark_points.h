#pragma once
// The filter's landmarks as points for the map of an unknown environment.
//
// A landmark's covariance in W contains the vehicle's own error, which the map shares. The map
// needs the rest, C - J P J^T, with P the covariance of the pose and J = [I, -[f - p]x R] the
// Jacobian of a point f fixed to the vehicle; for a landmark in the filter's state it can be
// negative, and is then zero.

#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/range_noise.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/filter/visual_update.h"

namespace dive::estimation {

/// The landmarks of a frame in B, m: those whose sigma relative to the vehicle, in the worst
/// direction, is at most `limit` at their distance. `estimate`: the filter's, at the time of the
/// frame. Values that are not finite give none.
[[nodiscard]] std::vector<Eigen::Vector3f> landmark_points_B(const StateEstimate& estimate,
                                                             std::span<const Landmark> landmarks,
                                                             const RangeNoise& limit);

}  // namespace dive::estimation
