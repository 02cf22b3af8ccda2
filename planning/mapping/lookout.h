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
  static constexpr double kFurthest = 3.0;  ///< m; seen_ahead() says no more.

  explicit Lookout(const RobotHull& hull);

  /// The newest sweep. It is kept when the vehicle has moved on or turned since the last kept one.
  void add(Sight sight);
  /// Were the newest sweeps looking past p_W, by at least `margin` m?
  [[nodiscard]] bool sees_past(const Eigen::Vector3f& p_W, float margin) const;
  /// Was it looked as far as p_W, and nothing there, as far as is remembered?
  [[nodiscard]] bool is_known(const Eigen::Vector3f& p_W) const;
  /// How far (m, up to kFurthest) the hull at X_WB can move ahead through water that was looked at:
  /// along v_W where that leads far off the bow, else along the bow. Asked every 0.2 m at the
  /// middle of the hull's box, right, left and below, and above where the eyes can see that.
  [[nodiscard]] double seen_ahead(const Pose& X_WB, const Eigen::Vector3d& v_W) const;

  void move(const std::function<Pose(Utime)>& correction);

 private:
  Eigen::Vector3f half_B_;  ///< Of the hull's box about B's origin.
  Sight latest_;
  std::deque<Sight> kept_;
};

}  // namespace dive::planning
