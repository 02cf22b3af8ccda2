#include "vehicle/convex_hull.h"

#include <limits>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include "common/assert.h"

namespace dive::vehicle {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_with_info_3<std::size_t, Kernel>;
using Triangulation = CGAL::Triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<Vertex>>;

constexpr std::size_t kUnused = std::numeric_limits<std::size_t>::max();

}  // namespace

// The hull's faces are those that a triangulation of the points shares with the outside.
TriangleSolid convex_hull(std::span<const Eigen::Vector3d> points) {
  Triangulation triangulation;
  for (const Eigen::Vector3d& p : points) {
    triangulation.insert(Kernel::Point_3(p.x(), p.y(), p.z()))->info() = kUnused;
  }
  DIVE_DEMAND(triangulation.dimension() == 3);

  TriangleSolid solid;
  const auto index_of = [&solid](const Triangulation::Vertex_handle& vertex) {
    if (vertex->info() == kUnused) {
      vertex->info() = solid.vertices.size();
      solid.vertices.emplace_back(vertex->point().x(), vertex->point().y(), vertex->point().z());
    }
    return vertex->info();
  };
  for (const Triangulation::Cell_handle cell : triangulation.all_cell_handles()) {
    if (!triangulation.is_infinite(cell)) continue;
    const int outside = cell->index(triangulation.infinite_vertex());
    std::array<std::size_t, 3> face{};
    for (int corner = 0; corner < 3; ++corner) {
      // Viewed from the cell's fourth vertex, here the outside, this order is counter-clockwise.
      face[static_cast<std::size_t>(corner)] =
          index_of(cell->vertex(Triangulation::vertex_triple_index(outside, corner)));
    }
    solid.faces.push_back(face);
  }
  return solid;
}

}  // namespace dive::vehicle
