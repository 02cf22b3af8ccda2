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
  int neighbours = 14;          ///< Points that a plane is fitted to.
  float longest_edge_m = 0.4F;  ///< Of a triangle.
  float edge_ratio = 3.0F;      ///< Edges are at most so many times the nearest point's distance.
  float apart_m = 0.05F;        ///< Points that come nearer than this to each other become one.
};

using Triangle = std::array<std::uint32_t, 3>;

struct SurfaceMesh {
  std::vector<Eigen::Vector3f> points;
  std::vector<Triangle> triangles;        ///< Indices into `points`.
  std::vector<std::uint32_t> stands_for;  ///< By input point: the one in `points` that it became.
};

/// Each point is first moved onto the plane of its neighbours, if that is no farther than its own
/// slack (m; of the size of its noise), so that layers that are only noise become one. Then
/// triangles between neighbours of a surface; points may be part of none: of something too thin, or
/// too far from all others. Finite points only. Deterministic.
[[nodiscard]] SurfaceMesh triangulate(std::span<const Eigen::Vector3f> points,
                                      std::span<const float> slack,
                                      const TriangulationOptions& options);

}  // namespace dive::planning
