#pragma once
// The exit path: how the vehicle leaves its present place without the executive, by depth and
// compass, and by map fixes where there are any. The executive makes it; supervisor, vehicle
// and the executive's own fallback follow it (vehicle/exit_guidance.h).

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/se3.h"

namespace dive::vehicle {

/// Maximum number of waypoints.
inline constexpr std::size_t kMaxExitWaypoints = 256;

struct ExitPath {
  Utime utime = 0;                ///< Time of the tick.
  std::int64_t revision = 0;      ///< Incremented whenever the waypoints change.
  Pose X_WB = {};                 ///< Estimated pose at that time.
  double position_sigma_m = 0.0;  ///< One sigma of its horizontal position, along the worst axis.
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();  ///< Estimated velocity through the water, m/s.
  double heading_correction = 0.0;  ///< Rotation from the compass to W about the vertical, rad.
  double speed_scale = 0.0;         ///< Estimated relative error of the full speed.
  Eigen::Vector2d current_W = Eigen::Vector2d::Zero();  ///< Estimated current, m/s.
  bool open_above = false;                              ///< Nothing solid is above X_WB.
  double hold_s = 0.0;  ///< Time for which the vehicle may hold before it leaves, s.
  double speed = 0.0;   ///< Speed along the waypoints, m/s.
  /// Certified clearance along the waypoints, m; 0 until it is certified.
  double clearance_m = 0.0;
  /// Level poses from the newest breadcrumb of the trail to a place with open water above, and room
  /// to drift where that is near. Empty at such a place, and where no exit path is known.
  std::vector<Pose> waypoints = {};
};

}  // namespace dive::vehicle
