#pragma once
// From points to triangles: PCL's plane fits and greedy projection (Marton, Rusu, Beetz, "On fast
// surface reconstruction methods for large and noisy point clouds", ICRA 2009).

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace dive::planning {

struct TriangulationOptions {
  int neighbours = 14;          ///< Number of points in a plane fit.
  float longest_edge_m = 0.4F;  ///< Largest edge of a triangle, m.
  float edge_ratio = 3.0F;      ///< Largest ratio of an edge to the distance of the nearest point.
  float apart_m = 0.05F;        ///< Distance below which two points are merged, m.
};

using Triangle = std::array<std::uint32_t, 3>;

struct SurfaceMesh {
  std::vector<Eigen::Vector3f> points;
  std::vector<Triangle> triangles;  ///< Triangles, as indices into `points`.
  /// By input point: index in `points` of the point that represents it.
  std::vector<std::uint32_t> stands_for;
};

/// Each point is first moved onto the plane of its neighbours, if that is no farther than its own
/// slack (m; about the size of its noise), so that layers that are only noise merge. Then
/// neighbours on a surface are joined to triangles. Points may belong to none: on an object too
/// thin, or too far from all others. Finite points only. Deterministic.
[[nodiscard]] SurfaceMesh triangulate(std::span<const Eigen::Vector3f> points,
                                      std::span<const float> slack,
                                      const TriangulationOptions& options);

}  // namespace dive::planning
