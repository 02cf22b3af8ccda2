#pragma once
// The way that a ball has most room on: what a sampling planner cannot say when it finds nothing.
// Dijkstra's algorithm over a grid with the bottleneck instead of the length as its cost (Pollack
// 1960, "The maximum capacity through a network"), distances looked up only where it comes.

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/world/scene.h"

namespace dive::planning {

struct WidestPathQuery {
  Eigen::Vector3d start_W;
  Eigen::Vector3d goal_W;
  Eigen::AlignedBox3d region;  ///< Positions that may be used.
  double enough = 1.0;         ///< m: more room than that is worth nothing, a shorter way is.
  double finest_cell = 0.2;    ///< m; coarser where the region would have more cells than ...
  int max_cells = 1'000'000;   ///< ... that.
};

struct WidestPath {
  std::vector<Eigen::Vector3d> positions;  ///< From start to goal, a cell apart.
  /// Least distance between the positions and the nearest obstacle, at most `enough`; what start
  /// and goal themselves have does not count.
  double radius = 0.0;
  /// No way within the region has more room than that, m.
  double bound = 0.0;
};

/// Nothing when start and goal are not connected.
[[nodiscard]] std::optional<WidestPath> widest_path(const Scene& scene,
                                                    const WidestPathQuery& query);

}  // namespace dive::planning
