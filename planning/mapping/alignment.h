#pragma once
// The error of the estimated position, from the observed part of the known map. Internal.

#include <functional>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "planning/mapping/voxel_cell.h"

namespace dive::planning {

/// A point of a scan, transformed to W by the estimated pose.
struct MapPoint {
  Eigen::Vector3f p_W;
  /// Normal of the surface at the point; absent if unclear.
  std::optional<Eigen::Vector3f> normal_W;
  float sigma_m;  ///< Standard deviation of its distance from the map's facets, m.
};

/// The facet of the map nearest to p_W, within `reach` m, and the height above it; null if none.
using NearestFacet =
    std::function<const Facet*(const Eigen::Vector3f& p_W, float reach, float& height)>;

/// Horizontal correction of the points, m, by point-to-plane matching (Chen, Medioni 1992) with
/// known attitude and depth, in iterations with decreasing reach. Minimises over t
///     |t|^2 / sigma_p^2 + sum of w (n . (p + t) - d)^2
/// with w from the noise of the point, reduced far off the plane (Huber 1964) and by the share of
/// the points that counts as independent. Zero if too few points lie on the map; at most 0.2 m.
[[nodiscard]] Eigen::Vector2f align_to_map(std::span<const MapPoint> points,
                                           const NearestFacet& nearest);

}  // namespace dive::planning
