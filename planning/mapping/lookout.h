#pragma once
// Where it has been looked: the latest sweep and a bounded history of earlier ones.

#include <deque>
#include <functional>

#include <Eigen/Core>

#include "common/clock.h"
#include "planning/mapping/sight.h"
#include "planning/world/world.h"

namespace dive::planning {

class Lookout {
 public:
  static constexpr std::size_t kMostSights = 64;
  /// So near to where it has been, a vehicle knows the water at its own level: it has turned there.
  /// What is above it was seen from farther off, or not at all.
  static constexpr float kKnown = 1.0F;        ///< m, horizontally ...
  static constexpr float kKnownHeight = 0.3F;  ///< ... and up and down.
  static constexpr double kFurthest = 3.0;     ///< m; seen_ahead() says no more.

  explicit Lookout(const RobotHull& hull);

  /// The newest sweep. It is kept when the vehicle has moved on or turned since the last kept one.
  void add(Sight sight);
  /// Were the newest sweeps looking past p_W, by at least `margin` m?
  [[nodiscard]] bool sees_past(const Eigen::Vector3f& p_W, float margin) const;
  /// Is p_W water that was looked at or swum in, as far as is remembered?
  [[nodiscard]] bool is_known(const Eigen::Vector3f& p_W) const;
  /// How far (m, up to kFurthest) the hull at X_WB can move along v_W through known water, or ahead
  /// for a vehicle at rest. A sweep across the hull's box every 0.2 m is asked for.
  [[nodiscard]] double seen_ahead(const Pose& X_WB, const Eigen::Vector3d& v_W) const;

  void move(const std::function<Pose(Utime)>& correction);

 private:
  Eigen::Vector3f half_B_;  ///< Of the hull's box about B's origin.
  Sight latest_;
  std::deque<Sight> kept_;
};

}  // namespace dive::planning
