#pragma once
// What one range scan says of the vehicle's position in the known map.

#include <Eigen/Core>

#include "common/clock.h"

namespace dive {

/// Why a scan gives no information.
enum class MapFixProblem {
  kNone,
  kFewPoints,  ///< Too few of its points have a mapped surface near them.
  kAmbiguous,  ///< Another position within the prior's uncertainty fits nearly as well.
  kNoScan,     ///< The sensor repeats a scan, or sends one without ranges.
};

/// A log-likelihood over the position x (m, in the map) at the time of the scan and the heading
/// correction c (rad, from the compass to the map). Up to a constant it is
///
///     gradient . d - d . information d / 2,    d = [x - position_W; c - heading_correction]
///
/// There is no information in directions that the scene does not constrain, and none at all with a
/// problem.
struct MapFix {
  Utime scan_utime = 0;
  MapFixProblem problem = MapFixProblem::kNone;
  Eigen::Vector2d position_W = Eigen::Vector2d::Zero();  ///< Point of linearisation, m.
  double heading_correction = 0.0;                       ///< The same, rad.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  double height_W =
      0.0;  ///< Height of B's origin by the scan, m; for times without a depth sensor.
  /// Its standard deviation, m; 0 with a problem, or if the scan does not constrain it.
  double height_sigma_m = 0.0;
  int used = 0;   ///< Number of points on mapped surfaces.
  int gated = 0;  ///< Number of points that no mapped surface explains.
  /// Likelihood of the second-best position relative to the best; 0: none was found.
  double ambiguity = 0.0;
};

/// True if all numbers are finite, the counts are not negative, the problem is one of the list and
/// the information is symmetric without negative variances.
[[nodiscard]] bool is_well_formed(const MapFix& fix);

}  // namespace dive
