#pragma once
// Observed space: the latest scan and a bounded history of earlier ones.

#include <deque>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/map_correction.h"
#include "planning/mapping/range_image.h"
#include "planning/world/world.h"

namespace dive::planning {

class ObservedSpace {
 public:
  static constexpr std::size_t kMaxScans = 64;
  static constexpr double kMaxDistance = 3.0;  ///< Upper limit of free_ahead(), m.

  explicit ObservedSpace(const RobotHull& hull);

  /// Adds the newest scan. It is stored if the vehicle has moved or turned since the last stored
  /// one.
  void add(RangeImage image);
  /// True if one of the newest scans passed p_W by at least `margin` m.
  [[nodiscard]] bool was_passed_recently(const Eigen::Vector3f& p_W, float margin) const;
  /// True if the newest scan or a stored one observed p_W as free.
  [[nodiscard]] bool is_observed_free(const Eigen::Vector3f& p_W) const;
  /// Distance (m, up to kMaxDistance) that the hull at X_WB can move ahead through observed free
  /// space: along v_W if it points far off the bow, else along the bow. Checked every 0.2 m at the
  /// middle of the hull's box, right, left and below, and above if the sensor can observe that.
  [[nodiscard]] double free_ahead(const Pose& X_WB, const Eigen::Vector3d& v_W) const;

  void move(const MapCorrection& correction);

 private:
  Eigen::Vector3f half_B_;  ///< Half size of the hull's box about B's origin, m.
  RangeImage latest_;
  std::deque<RangeImage> kept_;
};

}  // namespace dive::planning
