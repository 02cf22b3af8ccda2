#pragma once
// What a range sensor saw in one sweep: a range camera, or landmarks of a visual estimator.

#include <vector>

#include <Eigen/Core>

#include "common/clock.h"

namespace dive {

struct RangeScan {
  Utime utime = 0;                                     ///< When measured.
  Eigen::Vector3f origin_B = Eigen::Vector3f::Zero();  ///< Where the rays begin, m.
  float reach = 10.0F;                                 ///< m; nothing farther is told.
  /// In B, m, one per ray. NaN: the ray told nothing. Farther from the origin than `reach`: it was
  /// looked there, and nothing is in the way as far as `reach`.
  std::vector<Eigen::Vector3f> points_B = {};
};

/// Of one sweep; more is no sweep of ours.
inline constexpr std::size_t kMaxScanPoints = 65'536;

}  // namespace dive
