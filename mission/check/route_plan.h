#pragma once
// Paths for the legs of the nominal route.

#include <cstdint>
#include <string>
#include <vector>

#include "common/diagnostic.h"
#include "mission/check/route.h"
#include "mission/document/mission.h"
#include "planning/planner.h"

namespace dive::mission {

struct PlannedRouteLeg {
  std::string state;
  std::string goal;
  planning::PlanResult plan;
  planning::PlannerStatistics statistics;
};

/// Plans every leg of the nominal route from the previous goal. A reduced path is accepted where
/// the mission allows it: RouteLeg::reduced_clearance.
[[nodiscard]] std::vector<PlannedRouteLeg> plan_route(const Route& route,
                                                      const planning::World& world,
                                                      const planning::RobotHull& hull,
                                                      const planning::PlannerOptions& options,
                                                      std::uint64_t seed);

/// Reports legs without an accepted path (CHK-PLAN).
void report_failed_plans(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                         const Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
