#pragma once
// A world that differs from its map, as real ones do.

#include <cstdint>

#include "planning/world/world.h"
#include "vehicle/simulator/simulator.h"

namespace dive::vehicle {

/// The motion of the whole map from where it is drawn to where it is.
[[nodiscard]] Pose drawn_map_motion(const Conditions& conditions, std::uint64_t seed);

/// The map, shifted and turned as a whole (map_shift_sigma_m, map_turn_sigma_deg), and every object
/// of it shifted by itself (object_shift_sigma_m), horizontally. A mesh, and each
/// other collision of a link, is one object. The map itself if all three are 0.
[[nodiscard]] planning::World drawn_world(planning::World map, const Conditions& conditions,
                                          std::uint64_t seed);

}  // namespace dive::vehicle
