#include "planning/world/mesh_facts.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace dive::planning {
namespace {

using Eigen::Vector3d;

// A mesh is closed if its boundary is empty: edges, each with the lower vertex first and one bit
// for the direction, are adjacent after sorting.
bool encloses(const TriangleMesh& mesh) {
  static_assert(sizeof(mesh.triangles[0][0]) == 4);
  std::vector<std::uint64_t> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = t[k];
      const std::uint64_t b = t[(k + 1) % 3];
      if (a != b) edges.push_back(std::min(a, b) << 33U | std::max(a, b) << 1U | (a < b ? 1U : 0U));
    }
  }
  std::ranges::sort(edges);
  for (std::size_t i = 0; i < edges.size();) {
    const std::uint64_t edge = edges[i] >> 1U;
    int balance = 0;
    for (; i < edges.size() && edges[i] >> 1U == edge; ++i) balance += (edges[i] & 1U) ? 1 : -1;
    if (balance != 0) return false;
  }
  return true;
}

}  // namespace

MeshFacts facts_of(const TriangleMesh& mesh) {
  MeshFacts facts;
  double volume = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    for (const std::uint32_t i : {a, b, c}) facts.bounds.extend(mesh.vertices[i]);
  }
  if (mesh.triangles.empty()) return facts;
  const Vector3d origin = facts.bounds.center();
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d p = mesh.vertices[a] - origin;
    const Vector3d q = mesh.vertices[b] - origin;
    const Vector3d r = mesh.vertices[c] - origin;
    const double area = (q - p).cross(r - p).norm() / 2.0;
    facts.area_m2 += area;
    if ((p + q + r).z() / 3.0 + origin.z() > 0.0) facts.area_above_m2 += area;
    volume += p.dot(q.cross(r)) / 6.0;
  }
  facts.is_closed = encloses(mesh);
  if (facts.is_closed) facts.volume_m3 = volume;
  return facts;
}

}  // namespace dive::planning
