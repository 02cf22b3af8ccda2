#pragma once
// Two checked or planned missions side by side: legs, budgets, dives and findings, from the JSON of
// `dive check` and `dive plan`.

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <tl/expected.hpp>

#include "mission/diff/difference.h"

namespace dive::mission {

/// One number of both; absent: not known there.
struct Quantity {
  std::string name;  ///< "clearance"
  std::string unit;  ///< "m"; empty: none
  std::optional<double> a;
  std::optional<double> b;
  /// Both are known, and differ: what one of them did not compute is no difference.
  [[nodiscard]] bool differs() const { return a && b && *a != *b; }
};

struct LegComparison {
  std::string state;
  std::string goal;
  std::optional<std::string> status_a;  ///< Status of the plan; absent: there is no such leg.
  std::optional<std::string> status_b;
  std::vector<Quantity> quantities;
  /// Greatest distance (m) of a waypoint of one path from the other path; absent: not known.
  std::optional<double> apart_m;
  [[nodiscard]] bool differs() const;
};

struct PlanComparison {
  std::vector<LegComparison> legs;   ///< In the order of the first; those of the second alone last.
  std::vector<Quantity> budget;      ///< Of the route and of the simulated dives.
  std::vector<Difference> findings;  ///< Errors and warnings that only one of them has; readiness.
  [[nodiscard]] bool differs() const;
};

/// Requires two plans that parse_plan() accepted.
[[nodiscard]] PlanComparison compare_plans(const nlohmann::ordered_json& a,
                                           const nlohmann::ordered_json& b);

/// The JSON of `dive check --json`, or of `dive plan --json` for a mission or a single path. The
/// error is a sentence: it is none of these.
[[nodiscard]] tl::expected<nlohmann::ordered_json, std::string> parse_plan(const std::string& text);

}  // namespace dive::mission
