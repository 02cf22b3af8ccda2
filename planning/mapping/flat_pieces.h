#pragma once
// From triangles to convex pieces: flat polygons with a radius. A surface that was only seen from
// one side has no inside; what stands for it is as thin as the sweep was noisy, so that the water
// in front of it stays free.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "planning/mapping/triangulate.h"
#include "planning/world/world.h"

namespace dive::planning {

struct FlatPieceOptions {
  double flat_m = 0.03;  ///< A piece's points are no farther from its plane; beyond it is parted.
  double skin_m = 0.02;  ///< Of every piece: it reaches so far beyond its points.
  double grain_m = 0.1;  ///< What lies so near to a triangle counts as part of the surface.
};

/// Convex pieces that hold every point of the triangles and, within `skin_m` and the roundness of
/// their edges, nothing farther than `flat_m` above or below them, nor farther than about 1.5
/// `grain_m` beside them. Each has at most kMaxPieceVertices vertices, on one plane. Appended to
/// `pieces`. O(n log n).
void flat_pieces(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles,
                 const FlatPieceOptions& options, std::vector<Polytope>& pieces);

}  // namespace dive::planning
