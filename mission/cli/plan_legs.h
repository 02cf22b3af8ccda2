#pragma once
// The plan of a mission, with its progress on stderr.

#include <cstdint>
#include <vector>

#include "mission/check/route_plan.h"
#include "mission/cli/loading.h"

namespace dive::mission {

/// Printed in place of the clearance of plans in an unknown environment without a simulated world.
inline constexpr const char* kNotCertified = "not certified (no simulated world)";

/// Plans every leg of the route. Quiet: prints nothing.
[[nodiscard]] std::vector<PlannedRouteLeg> plan_legs(const LoadedMission& loaded,
                                                     const Route& route, std::uint64_t seed,
                                                     bool is_quiet);

}  // namespace dive::mission
