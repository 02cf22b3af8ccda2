#pragma once
// A dive over the link, for people and for scripts.

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "mission/link/linked_dive.h"

namespace dive::mission {

/// Lateness of the control loop and of aborts, refusals, jumps of clocks; a line each.
[[nodiscard]] std::vector<std::string> describe(const LinkStats& stats);

[[nodiscard]] nlohmann::ordered_json to_json(const LinkedResult& result, bool with_stats);

}  // namespace dive::mission
