#pragma once
// The plan of a mission, with its progress on stderr.

#include <cstdint>
#include <vector>

#include "mission/check/route_plan.h"
#include "mission/cli/loading.h"

namespace dive::mission {

/// Plans every leg of the route. Quiet: prints nothing.
[[nodiscard]] std::vector<PlannedRouteLeg> plan_legs(const LoadedMission& loaded,
                                                     const Route& route, std::uint64_t seed,
                                                     bool is_quiet);

}  // namespace dive::mission
