#pragma once
// The path with the largest clearance for a ball, which a sampling planner that finds no path
// cannot give. Dijkstra's algorithm over a grid with the bottleneck instead of the length as its
// cost (Pollack 1960, "The maximum capacity through a network"); distances are computed only where
// the search arrives.

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/world/scene.h"

namespace dive::planning {

struct WidestPathQuery {
  Eigen::Vector3d start_W;
  Eigen::Vector3d goal_W;
  Eigen::AlignedBox3d region;  ///< Allowed positions.
  double enough = 1.0;         ///< Clearance beyond which only a shorter path is better, m.
  /// Finest cell, m; coarser if the region would have more than `max_cells`.
  double finest_cell = 0.2;
  int max_cells = 1'000'000;  ///< Limit of cells in the region.
};

struct WidestPath {
  std::vector<Eigen::Vector3d> positions;  ///< Positions from start to goal, one cell apart.
  /// Least distance between the positions and the nearest obstacle, at most `enough`, m; excludes
  /// start and goal themselves.
  double radius = 0.0;
  /// Upper bound on the clearance of any path within the region, m.
  double bound = 0.0;
};

/// Absent if start and goal are not connected.
[[nodiscard]] std::optional<WidestPath> widest_path(const Scene& scene,
                                                    const WidestPathQuery& query);

}  // namespace dive::planning
