#pragma once
// Matches range scans with the known map: where is the vehicle, and in which directions does this
// scan say so?
//
// A point b of the scan (in B) lies at x = p + Rz(dpsi) R b for a pose with attitude R; the mapped
// surface nearest to it has the height phi(x) and the normal n there. Iterated point-to-plane
// (Chen, Medioni 1992) over the position p and a turn about the axes of W:
//
//   r = phi(x),   h = [n; R b x n]
//   w = kappa Huber(r / s) / s^2,   s^2 = s_range^2 (n . d)^2 + s_surface^2 + (s_angle range)^2
//
// with d the direction of the ray and kappa the share of the points that counts as independent. A
// point with |r| beyond its gate belongs to something that the map lacks. Height and tilt are
// measured by depth and attitude sensor, so that they are estimated with narrow priors and
// marginalised.
//
// Where the residuals are larger than s says (mapped objects that are off their places),
// information and differences of cost are divided by the variance of unit weight (as in the
// adjustment of geodetic networks), if that is above 1: the mean of r^2 / s^2, weighted by the
// square of n's horizontal part, because the floor says nothing of the position.

#include <memory>

#include <Eigen/Core>

#include "common/map_fix.h"
#include "common/range_noise.h"
#include "common/range_scan.h"
#include "common/se3.h"
#include "planning/map_matching/map_surface.h"

namespace dive::planning {

/// What is known of the pose before the scan.
struct PosePrior {
  Pose X_WB;
  double heading_correction = 0.0;  ///< Contained in X_WB, rad.
  double height_sigma_m = 0.0;      ///< Sigma of z, m.
  /// Covariance of x, y (m) and heading (rad).
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Earlier scans have confirmed it within the last seconds, so that it counts in full against
  /// another place that fits as well; a prior that is dead reckoned may be worse than it says.
  bool is_tracked = false;
};

/// A fix with the pose by which it compares scan and map.
struct MatchedScan {
  MapFix fix;
  Pose X_WB;
  double sigma_m = 0.0;  ///< Of X_WB's position, per horizontal axis: along the worst direction.

  /// True if the scan may show that a mapped object is gone: it gives a position that is good to
  /// 0.1 m, and what it shows agrees with the map in other places, flat ground apart.
  [[nodiscard]] bool may_show_absence() const;
};

/// Immutable, so that it may be used by several threads.
class MapMatcher {
 public:
  explicit MapMatcher(const World& world, const RangeNoise& noise = {});
  /// Demands a surface, which may be shared.
  explicit MapMatcher(std::shared_ptr<const MapSurface> surface, const RangeNoise& noise = {});
  MapMatcher(MapMatcher&&) noexcept;
  MapMatcher& operator=(MapMatcher&&) noexcept;
  ~MapMatcher();

  /// Demands a finite pose and a covariance without negative variances. Never throws for a scan:
  /// one that gives no information has a problem.
  [[nodiscard]] MapFix match(const RangeScan& scan, const PosePrior& prior) const {
    return place(scan, prior).fix;
  }
  [[nodiscard]] MatchedScan place(const RangeScan& scan, const PosePrior& prior) const;
  /// The information over x, y (m) and heading (rad) of the fix that a scan of the map as drawn,
  /// taken at X_WB without errors, gives if no other place fits as well; zero with too few points.
  [[nodiscard]] Eigen::Matrix3d expected_information(const RangeScan& scan, const Pose& X_WB) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
