#pragma once
// The report of a dive over the link, for people and for scripts.

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "mission/link/linked_dive.h"

namespace dive::mission {

/// Latency of the control loop and of aborts, rejected requests, clock jumps; one line each.
[[nodiscard]] std::vector<std::string> describe(const LinkStats& stats);

[[nodiscard]] nlohmann::ordered_json to_json(const LinkedResult& result, bool with_stats);

}  // namespace dive::mission
