#pragma once
// The vehicle's attitude along a path. B: x forward, y left, z up.

namespace dive::planning {

enum class AttitudeMode {
  kFree,        ///< x axis along the motion, roll free.
  kFlat,        ///< x axis along the motion, roll zero.
  kHorizontal,  ///< Roll and pitch zero, yaw along the motion (the Window's condition).
};
inline constexpr AttitudeMode kLastAttitudeMode = AttitudeMode::kHorizontal;

}  // namespace dive::planning
