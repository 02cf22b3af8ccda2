#pragma once
// Clearances over time, by the code that measures the ground truth. Private to mission/report.

#include <cstddef>

#include "mission/report/report.h"

namespace dive::mission {

/// Sets DiveSample::clearance_m of about `count` samples, evenly spaced: of the true pose, or of
/// the estimated pose if no sample has a true one. The other samples, and all in a world without
/// obstacles, stay NaN.
void measure_clearances(const planning::World& world, const planning::RobotHull& hull,
                        std::size_t count, std::vector<DiveSample>& samples);

/// The near misses among samples with a true pose; see NearMiss. `least_m`: the least clearance in
/// the true world. Where the map says much less than that, the map is wrong, and it was no near
/// miss.
[[nodiscard]] std::vector<NearMiss> near_misses(const planning::World& world,
                                                const planning::RobotHull& hull,
                                                double clearance_required_m, double least_m,
                                                const std::vector<DiveSample>& samples);

}  // namespace dive::mission
