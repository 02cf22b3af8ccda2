#pragma once
// The JSON output for scripts (one object on stdout).

#include <span>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "common/diagnostic.h"
#include "mission/check/check.h"
#include "mission/document/rules.h"
#include "mission/record/collision.h"
#include "mission/record/replay.h"
#include "mission/simulation/simulated_dive.h"
#include "planning/planner.h"

namespace dive::mission {

[[nodiscard]] nlohmann::ordered_json to_json(const Diagnostics& diagnostics);
/// SARIF 2.1.0, for code review tools.
[[nodiscard]] nlohmann::ordered_json to_sarif(const Diagnostics& diagnostics,
                                              std::span<const Rule> rules);
[[nodiscard]] nlohmann::ordered_json to_json(const planning::PlanResult& plan,
                                             const planning::PlannerStatistics& statistics);
[[nodiscard]] nlohmann::ordered_json to_json(const CheckReport& report,
                                             const Diagnostics& diagnostics);
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<TimedTransition>& transitions);
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<Collision>& collisions);
[[nodiscard]] nlohmann::ordered_json to_json(const NearestApproach& nearest);
[[nodiscard]] nlohmann::ordered_json to_json(const DiveResult& result);
[[nodiscard]] nlohmann::ordered_json to_json(const ReplayReport& report);
/// to_s is null where no tick follows.
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<LogGap>& gaps);

/// Prints the rules and their codes on stdout, one per line or as one object.
void print_rules(const std::vector<std::span<const Rule>>& tables, bool json);

/// Prints the value on stdout. Replaces bytes that are not UTF-8 (from an input file).
void print_json(const nlohmann::ordered_json& json);

}  // namespace dive::mission
