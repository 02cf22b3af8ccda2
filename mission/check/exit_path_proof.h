#pragma once
// The exit path from every point of the nominal route, proved on its planned paths.

#include <string>
#include <vector>

#include "common/diagnostic.h"
#include "mission/check/route_plan.h"
#include "mission/document/mission.h"
#include "planning/certify/certify.h"
#include "planning/world/world.h"

namespace dive::mission {

/// The exit path from the point of a leg from which it takes longest.
struct LegExit {
  double longest_m = 0.0;       ///< Length back along the route to open water; 0: straight up.
  double longest_s = 0.0;       ///< Time back along the route and up.
  bool has_open_water = false;  ///< Some point of the leg has open water above it,
  bool has_overhead = false;    ///< and some point has not.
};

/// The exit path from the point of the route where it is longest.
struct ExitPathProof {
  double longest_m = 0.0;  ///< Length back along the route to open water.
  /// Time back along the route and up, at the mission's speed and in the current of that time.
  double longest_s = 0.0;
  double clearance_m = 0.0;   ///< Certified clearance of the whole route swum backwards.
  std::string state;          ///< State with the longest exit path.
  bool exists = true;         ///< False: no open water precedes some point of the route.
  std::vector<LegExit> legs;  ///< From each leg of the route.
};

/// Longest gap (m) between breadcrumbs across which an exit path may take a short cut.
[[nodiscard]] double trail_link(const Mission& mission);

[[nodiscard]] ExitPathProof prove_exit_path(const Route& route,
                                            const std::vector<PlannedRouteLeg>& legs,
                                            const Mission& mission, const planning::World& world,
                                            const planning::RobotHull& hull,
                                            const planning::CertifyOptions& options);

/// Reports a missing exit path (CHK-NO-EXIT-PATH) and one that touches something (CHK-RETRACE).
void report_exit_path(const ExitPathProof& proof, const Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
