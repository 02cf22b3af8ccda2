#pragma once
// Speed over ground along a line in flowing water.
//
// A vehicle that swims at V through the water and points so that the current u does not take it off
// a line of unit direction e has the velocity g e over ground, with |g e - u| = V:
//
//   g = e.u + sqrt(V^2 - |u|^2 + (e.u)^2)
//
// The part of u along the line adds to its speed, and the part across it costs a crab angle.

#include <optional>
#include <span>

#include <Eigen/Core>

#include "common/se3.h"

namespace dive {

/// g, m/s; negative if the vehicle is carried backwards, empty if the part of the current across
/// the line is faster than the vehicle. `direction` has unit length.
[[nodiscard]] std::optional<double> speed_over_ground(const Eigen::Vector3d& direction,
                                                      double speed,
                                                      const Eigen::Vector2d& current_W);

/// A line on which g is less than this share of V is expected to take as long as with this share.
inline constexpr double kMinGroundSpeedShare = 0.05;

/// Time to swim from `from_W` to `to_W`, s.
[[nodiscard]] double swim_time_s(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W,
                                 double speed, const Eigen::Vector2d& current_W);
/// Time to swim a path, s.
[[nodiscard]] double swim_time_s(std::span<const Pose> path, double speed,
                                 const Eigen::Vector2d& current_W);

}  // namespace dive
