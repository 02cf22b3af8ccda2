#pragma once
// What is computed from one scan beside a fix: each result for one user.

#include <optional>

#include <Eigen/Core>

#include "common/clock.h"
#include "planning/world/obstacle_update.h"

namespace dive::planning {

/// For the speed limit in unknown environments.
struct FreeAhead {
  Utime scan_utime = 0;
  /// Distance that the hull can move in its direction of motion (ahead at rest) through observed
  /// free space, m.
  double free_ahead_m = 0.0;
};

/// For the proximity stop: the first obstacle in the vehicle's way if it moves on as it does now.
struct ObstacleAhead {
  Utime scan_utime = 0;
  double time_s = 0.0;                            ///< Time until the hull reaches it, s.
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();  ///< Its first point, at the time of the scan, m.
};

/// For localisation. No fix in W: it keeps the vehicle and its own map together.
struct PoseCorrection {
  Utime scan_utime = 0;
  /// Correction to add to the estimated horizontal position, from the observed part of the map, m.
  Eigen::Vector2d correction_W = Eigen::Vector2d::Zero();
};

inline constexpr double kMaxCorrection = 1.0;  ///< m, by one scan.

/// True if its numbers are finite and the correction is at most kMaxCorrection.
[[nodiscard]] bool is_well_formed(const FreeAhead& free_ahead);
[[nodiscard]] bool is_well_formed(const ObstacleAhead& obstacle);
[[nodiscard]] bool is_well_formed(const PoseCorrection& correction);

struct ScanResult {
  ObstacleUpdate obstacles;  ///< For planner and executive; no cells: the map has not changed.
  FreeAhead free_ahead;
  std::optional<PoseCorrection> correction;  ///< Absent if the scan agrees with the map.
};

}  // namespace dive::planning
