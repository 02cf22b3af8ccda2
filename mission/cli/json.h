#pragma once
// The JSON that scripts rely on (one object on stdout).

#include <span>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "common/diagnostic.h"
#include "mission/check/check.h"
#include "mission/check/simulated_dive.h"
#include "mission/document/rules.h"
#include "mission/record/replay.h"
#include "planning/planner.h"

namespace dive::mission {

[[nodiscard]] nlohmann::ordered_json to_json(const Diagnostics& diagnostics);
/// SARIF 2.1.0, as code review tools read it.
[[nodiscard]] nlohmann::ordered_json to_sarif(const Diagnostics& diagnostics,
                                              std::span<const Rule> rules);
[[nodiscard]] nlohmann::ordered_json to_json(const planning::PlanResult& plan);
[[nodiscard]] nlohmann::ordered_json to_json(const CheckReport& report,
                                             const Diagnostics& diagnostics);
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<TimedTransition>& transitions);
[[nodiscard]] nlohmann::ordered_json to_json(const DiveResult& result);
[[nodiscard]] nlohmann::ordered_json to_json(const ReplayReport& report);

/// Rules with their codes on stdout, a line each or as one object.
void print_rules(const std::vector<std::span<const Rule>>& tables, bool json);

/// Prints it on stdout. Bytes that are not UTF-8 (from a file somebody wrote) are replaced.
void print_json(const nlohmann::ordered_json& json);

}  // namespace dive::mission
