#pragma once
// What `dive diff` prints.

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "mission/diff/difference.h"
#include "mission/diff/log_difference.h"
#include "mission/diff/plan_difference.h"

namespace dive::mission {

void print_comparison(const LogComparison& comparison);
void print_comparison(const PlanComparison& comparison);
void print_differences(const char* title, const std::vector<Difference>& differences);

[[nodiscard]] nlohmann::ordered_json to_json(const LogComparison& comparison);
[[nodiscard]] nlohmann::ordered_json to_json(const PlanComparison& comparison);
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<Difference>& differences);

}  // namespace dive::mission
