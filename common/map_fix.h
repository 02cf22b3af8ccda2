#pragma once
// What one range scan says of the vehicle's position in the known map.

#include <Eigen/Core>

#include "common/clock.h"

namespace dive {

/// Why a scan gives no information.
enum class MapFixProblem {
  kNone,
  kFewPoints,  ///< Too few of its points have a mapped surface near them.
  /// Another position near the prior fits nearly as well. With information the numbers are those of
  /// one position, the same as in the scan before: from scan to scan it moves as the vehicle.
  kAmbiguous,
  kNoScan,  ///< The sensor repeats a scan, or sends one without ranges.
};
inline constexpr MapFixProblem kLastMapFixProblem = MapFixProblem::kNoScan;

/// How one scan agrees with the map: numbers of places, cubes with edges of a metre, in its view.
struct MapAgreement {
  int confirmed = 0;  ///< A mapped surface, not flat ground, is where the map has it.
  int missing = 0;    ///< The scan sees through a mapped surface.
  int unmapped = 0;   ///< The scan shows a surface that the map lacks.
  /// First obstacle of a mapped object through which the scan sees (planning::object_at()); -1:
  /// none.
  int missing_object = -1;

  /// Number of places that say anything.
  [[nodiscard]] int places() const { return confirmed + missing + unmapped; }
  /// True if the view differs from the map more than it agrees with it, by far: surfaces of another
  /// wreck lie on mapped ones here and there, and a scan is matched where it fits best.
  [[nodiscard]] bool contradicts() const { return missing + unmapped > 2 * confirmed; }
};

/// A log-likelihood over the position x (m, in the map) at the time of the scan and the heading
/// correction c (rad, from the compass to the map). Up to a constant it is
///
///     gradient . d - d . information d / 2,    d = [x - position_W; c - heading_correction]
///
/// There is no information in directions that the scene does not constrain, and with a problem none
/// that may be used as a position.
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
  MapAgreement agreement;  ///< All 0 where the position is too uncertain to tell.
};

/// True if all numbers are finite, the counts are not negative, the problem is one of the list and
/// the information is symmetric without negative variances.
[[nodiscard]] bool is_well_formed(const MapFix& fix);

}  // namespace dive
