#include "planning/mapping/surface_builder.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "planning/mapping/flat_pieces.h"
#include "planning/stopwatch.h"

namespace dive::planning {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr Utime kSettle = 150'000;  // us that a cell waits for more points before it is built
constexpr float kSlack = 2.5F;      // in sigma: distance a point may be moved onto its surface

bool is_chosen(const std::vector<CellKey>& chosen, CellKey key) {
  return std::binary_search(chosen.begin(), chosen.end(), key);
}

// The cell `key` (number 13) and its neighbours, by number 0 to 26.
Vector3i around(CellKey key, int i) {
  return cell_of(key) + Vector3i(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1);
}

bool is_near_chosen(const Vector3f& p_W, CellKey key, const std::vector<CellKey>& chosen,
                    float halo, float cell_m) {
  for (int i = 0; i < 27; ++i) {
    const Vector3i other = around(key, i);
    const Vector3f low = other.cast<float>() * cell_m;
    const Eigen::AlignedBox3f box(low, low + Vector3f::Constant(cell_m));
    if (box.squaredExteriorDistance(p_W) > halo * halo) continue;
    if (is_chosen(chosen, key_of(other))) return true;
  }
  return false;
}

}  // namespace

SurfaceBuilder::SurfaceBuilder(const MapperOptions& options, Clock& clock)
    : options_(options), clock_(clock) {}

SurfaceBuilder::Report SurfaceBuilder::update(VoxelMap& map, const Vector3f& p_W,
                                              const IsFree& is_free) const {
  Report report;
  build(map, choose(map, p_W, kSettle, options_.points_per_update, report), is_free, report);
  return report;
}

SurfaceBuilder::Report SurfaceBuilder::update_all(VoxelMap& map, const IsFree& is_free) const {
  Report report;
  build(map, choose(map, Vector3f::Zero(), 0, std::numeric_limits<int>::max(), report), is_free,
        report);
  return report;
}

// The stale cells to build now: the nearest, up to `max_points` points.
SurfaceBuilder::Keys SurfaceBuilder::choose(const VoxelMap& map, const Vector3f& p_W, Utime settle,
                                            int max_points, Report& report) {
  std::vector<std::pair<float, CellKey>> stale;
  for (const auto& [key, cell] : map.cells()) {
    if (cell.stale_since == 0 || map.time() - cell.stale_since < settle) continue;
    const Vector3f middle =
        (cell_of(key).cast<float>() + Vector3f::Constant(0.5F)) * map.grid().cell_m();
    stale.emplace_back((middle - p_W).squaredNorm(), key);
  }
  std::sort(stale.begin(), stale.end());
  Keys chosen;
  std::size_t points = 0;
  for (const auto& [distance, key] : stale) {
    points += map.cells().at(key).voxels.size();
    if (!chosen.empty() && points > static_cast<std::size_t>(max_points)) break;
    chosen.push_back(key);
  }
  report.waiting_cells = static_cast<int>(stale.size() - chosen.size());
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

// The confirmed voxels of the chosen cells, and those near them, which their surfaces continue to.
std::vector<SurfaceBuilder::Gathered> SurfaceBuilder::gather(VoxelMap& map,
                                                             const Keys& chosen) const {
  Keys keys = chosen;
  for (const CellKey key : chosen) {
    for (int i = 0; i < 27; ++i) keys.push_back(key_of(around(key, i)));
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<Gathered> gathered;
  const auto halo = static_cast<float>(options_.longest_edge_m);
  for (const CellKey key : keys) {
    const auto at = map.cells().find(key);
    if (at == map.cells().end()) continue;
    const bool is_whole = is_chosen(chosen, key);
    for (Voxel& v : at->second.voxels) {
      if (v.confirmed &&
          (is_whole || is_near_chosen(v.p_W, key, chosen, halo, map.grid().cell_m()))) {
        gathered.push_back({&v, key});
      }
    }
  }
  return gathered;
}

SurfaceMesh SurfaceBuilder::mesh_of(const std::vector<Gathered>& gathered, float voxel_m) const {
  std::vector<Vector3f> points;
  std::vector<float> slack;
  for (const Gathered& one : gathered) {
    points.push_back(one.voxel->p_W);
    slack.push_back(kSlack * one.voxel->noise);
  }
  TriangulationOptions triangulation;
  triangulation.longest_edge_m = static_cast<float>(options_.longest_edge_m);
  triangulation.apart_m = 0.5F * voxel_m;
  return triangulate(points, slack, triangulation);
}

void SurfaceBuilder::build(VoxelMap& map, const Keys& chosen, const IsFree& is_free,
                           Report& report) const {
  if (chosen.empty()) return;
  report.meshed_cells = static_cast<int>(chosen.size());
  const std::vector<Gathered> gathered = gather(map, chosen);
  report.meshed_points = static_cast<int>(gathered.size());
  SurfaceMesh mesh;
  {
    const Stopwatch stopwatch(clock_, report.triangulate_ms);
    mesh = mesh_of(gathered, map.grid().voxel_m());
  }
  const Stopwatch stopwatch(clock_, report.divide_ms);
  std::vector<Keys> cells_of(mesh.points.size());
  for (std::size_t i = 0; i < gathered.size(); ++i) {
    Keys& owners = cells_of[mesh.stands_for[i]];
    if (is_chosen(chosen, gathered[i].key) &&
        std::find(owners.begin(), owners.end(), gathered[i].key) == owners.end()) {
      owners.push_back(gathered[i].key);
    }
  }
  // A triangle goes to every chosen cell that it touches: a cell covers its own points, whatever
  // becomes of the cells around it.
  TrianglesByCell triangles;
  std::vector<char> is_corner(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    const Vector3f middle = (mesh.points[t[0]] + mesh.points[t[1]] + mesh.points[t[2]]) / 3.0F;
    if (is_free(middle)) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      is_corner[t[i]] = true;
      for (const CellKey key : cells_of[t[i]]) {
        std::vector<Triangle>& mine = triangles[key];
        if (mine.empty() || mine.back() != t) mine.push_back(t);
      }
    }
  }
  for (std::size_t i = 0; i < gathered.size(); ++i) {
    if (is_chosen(chosen, gathered[i].key)) {
      gathered[i].voxel->meshed = is_corner[mesh.stands_for[i]] != 0;
    }
  }
  divide(map, chosen, mesh, triangles);
}

void SurfaceBuilder::divide(VoxelMap& map, const Keys& chosen, const SurfaceMesh& mesh,
                            TrianglesByCell& triangles) const {
  const FlatPieceOptions division{options_.flat_m, options_.skin_m, options_.voxel_m};
  for (const CellKey key : chosen) {
    Cell& cell = map.cells().at(key);
    cell.surface.clear();
    cell.facets.clear();
    flat_pieces(mesh.points, triangles[key], division, cell.surface);
    for (const Polytope& piece : cell.surface) cell.facets.emplace_back(piece);
    cell.stale_since = 0;
    cell.changed = true;
  }
}

}  // namespace dive::planning
