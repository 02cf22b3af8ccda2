#pragma once
// Values that no sensor can have measured.

#include "estimation/dataset/recording.h"

namespace dive::estimation {

/// Limits of what is taken for a measurement. The widest ranges of inertial sensors for vehicles
/// are 4000 deg/s = 70 rad/s and 40 g; those of shock sensors are beyond any use here.
inline constexpr double kMaxRate = 100.0;           ///< rad/s
inline constexpr double kMaxAcceleration = 1000.0;  ///< m/s^2
inline constexpr double kMaxDepth_m = 11'000.0;     ///< The deepest sea; as far above the surface.
/// m/s, of a DVL: one without a lock on the ground states tens of m/s.
inline constexpr double kMaxVelocity = 10.0;
inline constexpr double kMaxTrueDistance_m = 1e6;  ///< From W's origin.

/// False for a quaternion that is not of length 1, such as one before tracking began.
[[nodiscard]] bool is_attitude(const Eigen::Quaterniond& q);

/// Removes samples that are not finite or beyond these limits, and true poses without an attitude,
/// each sensor's with one warning at the first of them: a missing sample is bridged by the
/// estimators as a gap, with the uncertainty of one, while a wrong one is integrated. Adds an error
/// if more than a twentieth of the IMU's samples are removed, or if their median specific force is
/// not about gravity: then their unit is wrong.
void screen_samples(Recording& recording);

}  // namespace dive::estimation
