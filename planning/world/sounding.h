#pragma once
// The height of the ground below a point.

#include <optional>

#include <Eigen/Core>

#include "planning/world/scene.h"

namespace dive::planning {

/// Height (z in W) of the first solid straight below `p_W`, found by sphere tracing on the point
/// distance; absent if there is none within `range` m. For a point inside a solid, its own height.
[[nodiscard]] std::optional<double> ground_below(const Scene& scene, const Eigen::Vector3d& p_W,
                                                 double range = 200.0);

}  // namespace dive::planning
