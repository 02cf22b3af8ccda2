#pragma once
// What an uncertain position leaves of a clearance. At a pose with an obstacle at distance d in the
// direction n
//
//   margin = (d - t) / sqrt(n' P n)
//
// with t the distance by which the follower may leave the path, and P the covariance of the
// position among the obstacles as they are drawn. A margin of m means a collision with probability
// Phi(-m) there, if the errors are normal.

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "common/se3.h"
#include "planning/world/scene.h"
#include "planning/world/world.h"

namespace dive::planning {

/// t, m: the follower's largest distance from a leg's path in dives with known position.
inline constexpr double kFollowerTube = 0.1;

/// The least margin of some poses, and where it is.
struct PositionMargin {
  double margin_sigma = std::numeric_limits<double>::infinity();  ///< Infinite: nothing is near.
  Eigen::Vector3d place_W = Eigen::Vector3d::Zero();              ///< B's origin there, m.
  int obstacle = -1;         ///< Index in the scene's world of the obstacle nearest there.
  double clearance_m = 0.0;  ///< d
  double sigma_m = 0.0;      ///< sqrt(n' P n)
};

/// Has scratch memory: one per thread.
class PositionMarginMeter {
 public:
  explicit PositionMarginMeter(const RobotHull& hull);

  /// Grows the scratch memory, also that of `scene`, so that reduce() allocates nothing.
  void reserve(Scene& scene);

  /// Replaces `least` by the margin at X_WB if that is smaller. `P_W` (m^2): covariance of the
  /// horizontal position; the height's is that of a depth sensor. Obstacles farther than 3 m do not
  /// count.
  void reduce(Scene& scene, const Pose& X_WB, const Eigen::Matrix2d& P_W, PositionMargin& least);

 private:
  std::vector<Eigen::Vector3d> hull_B_;
  double radius_;
  std::vector<Eigen::Vector3d> hull_W_;
  std::vector<Contact> contacts_;
};

}  // namespace dive::planning
