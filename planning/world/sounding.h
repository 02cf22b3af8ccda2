#pragma once
// How far down is the ground?

#include <optional>

#include <Eigen/Core>

#include "planning/world/scene.h"

namespace dive::planning {

/// Height (z in W) of the first solid straight below `p_W`, found by sphere tracing on the point
/// distance; nothing within `range` m. A point inside a solid is its own ground.
[[nodiscard]] std::optional<double> ground_below(const Scene& scene, const Eigen::Vector3d& p_W,
                                                 double range = 200.0);

}  // namespace dive::planning
