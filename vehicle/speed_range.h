#pragma once
// Speeds that the Aqua2 can swim, m/s.

namespace dive::vehicle {

inline constexpr double kMinSpeed = 0.1;  ///< From about here on it holds its depth.
inline constexpr double kMaxSpeed = 0.8;  ///< Full effort.

}  // namespace dive::vehicle
