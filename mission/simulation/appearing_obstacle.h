#pragma once
// Obstacles that a scenario or a fault adds to the simulated world during a dive. The vehicle
// observes them at once, or has to find them by its scans.

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/se3.h"
#include "planning/world/obstacle_update.h"
#include "planning/world/world.h"

namespace dive::mission {

/// A box in W.
struct AppearingObstacle {
  Pose X_WO;
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  ///< Edge lengths, m, 0 to 100.
  /// False: the vehicle's map does not get it, but the range camera measures it. An observed one is
  /// not in the scans.
  bool is_observed = true;
};

/// For the ground truth: named "obstacle 1", "obstacle 2", ... after `before` earlier ones.
[[nodiscard]] std::vector<planning::Obstacle> as_obstacles(
    std::span<const AppearingObstacle> appearing, std::size_t before);

/// For the vehicle: the update of its observed map, a cell for each observed box. A box larger than
/// a piece may be is divided.
[[nodiscard]] planning::ObstacleUpdate as_update(std::span<const AppearingObstacle> appearing,
                                                 std::size_t before, Utime now);

}  // namespace dive::mission
