#pragma once
// Surfaces of the map's cells: occupied voxels are triangulated, and the triangles divided into
// flat convex pieces. Incremental: only cells whose voxels changed, the nearest first. Internal.

#include <functional>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "planning/mapping/mapper_options.h"
#include "planning/mapping/triangulate.h"
#include "planning/mapping/voxel_map.h"

namespace dive::planning {

class SurfaceBuilder {
 public:
  /// True if the point (W) was observed free: no triangle may span it.
  using IsFree = std::function<bool(const Eigen::Vector3f&)>;

  /// Work and times of one update. The times depend on the machine.
  struct Report {
    int meshed_cells = 0;   ///< Number of cells with new surfaces.
    int meshed_points = 0;  ///< Number of points triangulated.
    int waiting_cells = 0;  ///< Number of stale cells left for a later update.
    double triangulate_ms = 0.0;
    double divide_ms = 0.0;
  };

  SurfaceBuilder(const MapperOptions& options, Clock& clock);

  /// Builds the surfaces of stale cells, those nearest to `p_W` first, up to `points_per_update`
  /// points. A cell waits a moment for more points before it is built.
  Report update(VoxelMap& map, const Eigen::Vector3f& p_W, const IsFree& is_free) const;
  /// Builds the surfaces of all stale cells now.
  Report update_all(VoxelMap& map, const IsFree& is_free) const;

 private:
  struct Gathered {
    Voxel* voxel;
    CellKey key;
  };
  using Keys = std::vector<CellKey>;  // in ascending order
  using TrianglesByCell = std::unordered_map<CellKey, std::vector<Triangle>>;

  [[nodiscard]] static Keys choose(const VoxelMap& map, const Eigen::Vector3f& p_W, Utime settle,
                                   int max_points, Report& report);
  [[nodiscard]] std::vector<Gathered> gather(VoxelMap& map, const Keys& chosen) const;
  void build(VoxelMap& map, const Keys& chosen, const IsFree& is_free, Report& report) const;
  [[nodiscard]] SurfaceMesh mesh_of(const std::vector<Gathered>& gathered, float voxel_m) const;
  void divide(VoxelMap& map, const Keys& chosen, const SurfaceMesh& mesh,
              TrianglesByCell& triangles) const;

  MapperOptions options_;
  Clock& clock_;
};

}  // namespace dive::planning
