#pragma once
// From triangles to convex pieces: flat polygons with a radius. A surface observed from one side
// only has no inside; its pieces are as thin as the noise of the scans, so that the water in front
// of it stays free.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "planning/mapping/triangulate.h"
#include "planning/world/world.h"

namespace dive::planning {

struct FlatPieceOptions {
  /// Largest distance of a piece's points from its plane, m; beyond it the piece is split.
  double flat_m = 0.03;
  double skin_m = 0.02;  ///< Radius of every piece: its extent beyond its points, m.
  /// Distance from a triangle within which a point counts as part of the surface, m.
  double grain_m = 0.1;
};

/// Convex pieces that contain every point of the triangles and, within `skin_m` and the roundness
/// of their edges, nothing farther than `flat_m` above or below them, nor farther than about 1.5
/// `grain_m` beside them. Each has at most kMaxPieceVertices vertices, on one plane. Appended to
/// `pieces`. O(n log n).
void flat_pieces(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles,
                 const FlatPieceOptions& options, std::vector<Polytope>& pieces);

}  // namespace dive::planning
