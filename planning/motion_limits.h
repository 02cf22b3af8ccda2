#pragma once
// The limits of a path, as one value from the mission to the optimiser and the sampling planner.
// Heights are z in W, m: z up, 0 at the surface, negative under water.

#include <limits>

#include "planning/attitude_mode.h"

namespace dive::planning {

struct MotionLimits {
  AttitudeMode attitude = AttitudeMode::kFree;
  double clearance = 0.6;  ///< D_min: least distance from the hull to anything solid, m.
  /// Least clearance of an acceptable path out of a start that lacks D_min, m; infinite: no such
  /// path is acceptable.
  double reduced_clearance = std::numeric_limits<double>::infinity();
  double min_z = -50.0;         ///< Depth limit, z in W, m.
  double max_z = 0.0;           ///< Upper limit, z in W, m; 0 is the surface.
  double min_altitude = 0.0;    ///< Height above the ground straight below, m; soft beyond D_min.
  double goal_tolerance = 0.0;  ///< Largest shift of a goal that lacks D_min, m.
};

inline constexpr double kMaxGoalTolerance = 5.0;  ///< Bound of MotionLimits::goal_tolerance, m.
inline constexpr double kMaxAltitude = 100.0;     ///< Bound of MotionLimits::min_altitude, m.

}  // namespace dive::planning
