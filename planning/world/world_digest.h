#pragma once
// Tells whether two processes have the same map.

#include <cstdint>

#include "planning/world/world.h"

namespace dive::planning {

/// FNV-1a 64 of the obstacles' names, shapes and poses, to the last bit; never 0.
[[nodiscard]] std::uint64_t world_digest(const World& world);

}  // namespace dive::planning
