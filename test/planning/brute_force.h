#pragma once
// Paths measured by looking, and not by what planned or certified them.

#include <vector>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::testing {

/// The least clearance (m) over looks along the path of which no point of the hull moves more than
/// a millimetre from one to the next, by the simulator's ground truth. Looks are left out where the
/// last one was so far from everything that the hull cannot have come nearer than `interesting`.
[[nodiscard]] double measured_clearance(const planning::World& world,
                                        const planning::RobotHull& hull,
                                        const std::vector<Pose>& path, double interesting);

/// By how much (m) the ground truth may measure too little: its cylinders are polyhedra around the
/// true ones.
[[nodiscard]] double measured_too_little(const planning::World& world);

}  // namespace dive::testing
