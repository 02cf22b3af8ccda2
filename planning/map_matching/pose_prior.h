#pragma once
// What is known of the vehicle's pose before a scan is matched with the map.

#include <Eigen/Core>

#include "common/se3.h"

namespace dive::planning {

struct PosePrior {
  Pose X_WB;
  double heading_correction = 0.0;  ///< Contained in X_WB, rad.
  /// Position by the odometry, which no fix moves, m. From scan to scan it tells the motion.
  Eigen::Vector2d odometry_O = Eigen::Vector2d::Zero();
  double height_sigma_m = 0.0;  ///< Of z, m.
  /// Covariance of x, y (m) and heading (rad).
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Earlier scans have confirmed it within the last seconds, so that it counts in full against
  /// another place that fits as well; a prior that is dead reckoned may be worse than it says.
  bool is_tracked = false;
};

}  // namespace dive::planning
