#pragma once
// The report of a plan: the map and the planned legs, without time.

#include <vector>

#include "mission/check/route_plan.h"
#include "mission/document/mission.h"
#include "mission/report/report.h"
#include "vehicle/model.h"

namespace dive::mission {

/// `map` is the text of the map file.
[[nodiscard]] Report report_of_plan(const Mission& mission, std::string_view map,
                                    const planning::World& world, const vehicle::Model& model,
                                    const std::vector<PlannedRouteLeg>& legs, std::uint64_t seed);

}  // namespace dive::mission
