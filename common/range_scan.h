#pragma once
// One scan of a range sensor: of a range camera, or of a stereo pair with the landmarks of a visual
// estimator.

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"

namespace dive {

struct RangeScan {
  Utime utime = 0;                                     ///< Time of measurement.
  Eigen::Vector3f origin_B = Eigen::Vector3f::Zero();  ///< Origin of the rays, m.
  float reach = 10.0F;                                 ///< Maximum range, m.
  /// Points in B, m, one per ray. NaN: no information along the ray. Farther from the origin than
  /// `reach`: the ray found nothing up to `reach`.
  std::vector<Eigen::Vector3f> points_B = {};
  /// Number of points, the last ones, that are landmarks of a visual estimator: observed from
  /// several places, so that one without others around it is no noise.
  std::size_t landmarks = 0;
};

/// Maximum number of points of one scan.
inline constexpr std::size_t kMaxScanPoints = 65'536;

}  // namespace dive
