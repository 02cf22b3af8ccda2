#pragma once
// Clearance of paths by sampling, independent of the planner and the certificate.

#include <vector>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::testing {

/// The least clearance (m) over samples of the path, between which no point of the hull moves more
/// than a millimetre, by the simulator's ground truth. Samples are skipped if the last one was so
/// far from everything that the hull cannot have come nearer than `interesting`.
[[nodiscard]] double measured_clearance(const planning::World& world,
                                        const planning::RobotHull& hull,
                                        const std::vector<Pose>& path, double interesting);

/// Largest amount (m) by which the ground truth underestimates a distance: its cylinders are
/// polyhedra around the true ones.
[[nodiscard]] double measured_too_little(const planning::World& world);

}  // namespace dive::testing
