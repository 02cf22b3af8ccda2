#pragma once
// The free positions of a ball of some radius: away from the world and outside virtual obstacles.
// Motions are checked in steps of the free distance, so a free motion of any length in open water
// takes one or two queries, and no obstacle is skipped.

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "planning/warm_start/warm_start.h"
#include "planning/world/scene.h"

namespace dive::planning {

class FreeSpace {
 public:
  /// Stores a reference to `scene`.
  FreeSpace(const Scene& scene, double radius, std::vector<VirtualObstacle> virtual_obstacles);

  /// Distance by which a position may move in any direction and stay free, m; negative if it is not
  /// free.
  [[nodiscard]] double slack(const Eigen::Vector3d& p_W) const;
  /// True if the straight motion is free, to within kStep / 2 of the radius.
  [[nodiscard]] bool is_free(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const;

  static constexpr double kStep = 0.01;  ///< Least step along a motion, m.

 private:
  [[nodiscard]] double measure(const Eigen::Vector3d& p_W) const;

  const Scene& scene_;
  double radius_;
  std::vector<VirtualObstacle> virtual_obstacles_;

  // Cached slack of a position. A search queries the same position repeatedly: whether it is free,
  // its cost, and as the end of a motion.
  struct Known {
    Eigen::Vector3d p_W;
    double slack;
  };
  static constexpr std::size_t kKnown = 4;
  mutable std::array<Known, kKnown> known_;
  mutable std::size_t oldest_ = 0;
};

/// A polyline with the same ends and free legs, no longer than `path`: from each point a straight
/// leg to the farthest reachable point, forward and then backward.
[[nodiscard]] std::vector<Eigen::Vector3d> shorten(const FreeSpace& space,
                                                   const std::vector<Eigen::Vector3d>& path,
                                                   double spacing);

/// Keeps every corner and divides the legs evenly so that no two points are farther apart than
/// `spacing`.
[[nodiscard]] std::vector<Eigen::Vector3d> resample(const std::vector<Eigen::Vector3d>& path,
                                                    double spacing);

}  // namespace dive::planning
