#pragma once
// What one scan shows in the way of the vehicle. It uses neither a map nor a position in one, so
// that it holds where both are wrong: the way is seen from where the vehicle is, not where it
// believes to be.

#include <optional>
#include <span>

#include <Eigen/Geometry>

#include "common/range_scan.h"
#include "common/se3.h"
#include "planning/mapping/scan_result.h"
#include "planning/world/world.h"

namespace dive::planning {

class SweptHull {
 public:
  /// Time over which the motion is predicted, s.
  static constexpr double kHorizon = 1.5;
  /// Distance from the hull within which a point is in the way, m. A point that is nearer than
  /// twice that already is in the way if it comes to half its distance.
  static constexpr double kMargin = 0.05;

  explicit SweptHull(const RobotHull& hull);

  /// The first surface that the box around the hull reaches on its way through the poses `way_W`,
  /// the first of which is that at the time of the scan, at `speed` (m/s). A particle, alone and
  /// small, is no surface. Only the way from the first pose matters, not where that pose is.
  [[nodiscard]] std::optional<ObstacleAhead> first_obstacle(const RangeScan& scan,
                                                            std::span<const Pose> way_W,
                                                            double speed) const;

 private:
  Eigen::AlignedBox3f box_B_;
  float radius_ = 0.0F;  ///< Of a ball around B's origin that contains the box, m.
};

}  // namespace dive::planning
