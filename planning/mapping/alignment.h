#pragma once
// How far the vehicle is from where it was thought to be, by what it sees of the map. Internal.

#include <functional>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "planning/mapping/voxel_cell.h"

namespace dive::planning {

/// A point of a sweep, put where the vehicle was thought to be.
struct SeenPoint {
  Eigen::Vector3f p_W;
  std::optional<Eigen::Vector3f> normal_W;  ///< Of what it lies on; nothing where that is unclear.
  float sigma_m;                            ///< One, of its distance from the map's facets.
};

/// The facet of the map nearest to p_W, within `reach` m, and the height above it; null: none.
using NearestFacet =
    std::function<const Facet*(const Eigen::Vector3f& p_W, float reach, float& height)>;

/// Point to plane (Chen, Medioni 1992), the attitude and the depth being known: what the points
/// are to be moved by, m, horizontally, from near to nearer facets. Minimises over t
///   |t|^2 / sigma_p^2 + sum of w (n . (p + t) - d)^2
/// w from the noise of the point, less far off the plane (Huber 1964), and for few of the points
/// counting as independent. Zero where too few points lie on the map; 0.2 m at most.
[[nodiscard]] Eigen::Vector2f off_the_map(std::span<const SeenPoint> points,
                                          const NearestFacet& nearest);

}  // namespace dive::planning
