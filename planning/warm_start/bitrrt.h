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
  Eigen::AlignedBox3d region;  ///< Allowed positions; contains start and goal.
  /// Slack below which a position has a cost, m; moves to a higher cost are rarely accepted.
  double preferred_slack = 0.7;
  int max_iterations = 20'000;
  std::uint64_t seed = 1;
};

/// A free polyline from start to goal; absent if none is found within the iterations. The same
/// query gives the same result.
[[nodiscard]] std::optional<std::vector<Eigen::Vector3d>> bitrrt(const FreeSpace& space,
                                                                 const BiTrrtQuery& query);

}  // namespace dive::planning
