#pragma once
// How well a scan taken at a pose would tell the position, by the known map alone.

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "common/range_view.h"
#include "common/se3.h"
#include "planning/map_matching/map_matcher.h"
#include "planning/map_matching/map_surface.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Immutable, so that it may be used by several threads.
class ExpectedView {
 public:
  /// Copies what it needs of `world`.
  explicit ExpectedView(const World& world, const RangeView& view = {});

  /// Information of a fix from one scan at X_WB about x, y (1/m^2) and heading (1/rad^2):
  /// MapMatcher::expected_information(). Demands a finite pose.
  [[nodiscard]] Eigen::Matrix3d information(const Pose& X_WB) const;
  /// Standard deviation (m) of such a fix along the horizontal direction that the scan constrains
  /// least; infinite where it does not constrain it. Demands a finite pose.
  [[nodiscard]] double worst_sigma(const Pose& X_WB) const;

 private:
  [[nodiscard]] RangeScan scan_at(const Pose& X_WB) const;
  [[nodiscard]] double range(const Eigen::Vector3d& origin_W,
                             const Eigen::Vector3d& direction_W) const;

  std::shared_ptr<const MapSurface> surface_;
  MapMatcher matcher_;
  RangeView view_;
  std::vector<Eigen::Vector3d> rays_B_;  ///< Unit vectors.
};

}  // namespace dive::planning
