#pragma once
// What is plausible in samples of the sensors and in commands.

#include <cmath>

#include <Eigen/Geometry>

namespace dive::vehicle {

inline constexpr double kMaxPlausibleDepth = 500.0;  ///< m

/// True if the norm is almost 1; false for NaN.
[[nodiscard]] inline bool is_attitude(const Eigen::Quaterniond& q) {
  return std::abs(q.norm() - 1.0) <= 0.1;
}

}  // namespace dive::vehicle
