#pragma once
// Where a ball of some radius may be: away from the world and outside virtual obstacles. Motions
// are checked by stepping as far as the free distance allows, so a free motion of any length in
// open water takes one or two looks, and none is skipped.

#include <vector>

#include <Eigen/Core>

#include "planning/warm_start/warm_start.h"
#include "planning/world/scene.h"

namespace dive::planning {

class FreeSpace {
 public:
  /// Keeps a reference to `scene`.
  FreeSpace(const Scene& scene, double radius, std::vector<VirtualObstacle> virtual_obstacles);

  /// How far a position may move in any direction and stay free; negative when it is not.
  [[nodiscard]] double slack(const Eigen::Vector3d& p_W) const;
  /// Is the straight motion free? Holds to within kStep / 2 of the radius.
  [[nodiscard]] bool is_free(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const;

  static constexpr double kStep = 0.01;  ///< m, least step along a motion.

 private:
  const Scene& scene_;
  double radius_;
  std::vector<VirtualObstacle> virtual_obstacles_;
};

/// A polyline with the same ends whose legs are free, no longer than `path`: from each point on to
/// the farthest that can be reached straight, forward and then backward.
[[nodiscard]] std::vector<Eigen::Vector3d> shorten(const FreeSpace& space,
                                                   const std::vector<Eigen::Vector3d>& path,
                                                   double spacing);

/// Keeps every corner and divides the legs evenly so that no two points are farther apart than
/// `spacing`.
[[nodiscard]] std::vector<Eigen::Vector3d> resample(const std::vector<Eigen::Vector3d>& path,
                                                    double spacing);

}  // namespace dive::planning
