#pragma once
// OMPL's BiT-RRT over positions in a box.

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/warm_start/free_space.h"

namespace dive::planning {

struct BiTrrtQuery {
  Eigen::Vector3d start_W;
  Eigen::Vector3d goal_W;
  Eigen::AlignedBox3d region;    ///< Positions that may be used; holds start and goal.
  double preferred_slack = 0.7;  ///< m: below it a position costs, and uphill is rarely taken.
  int max_iterations = 20'000;
  std::uint64_t seed = 1;
};

/// A free polyline from start to goal, or nothing within the iterations. Same query, same result.
[[nodiscard]] std::optional<std::vector<Eigen::Vector3d>> bitrrt(const FreeSpace& space,
                                                                 const BiTrrtQuery& query);

}  // namespace dive::planning
