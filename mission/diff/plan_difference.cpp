#include "mission/diff/plan_difference.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include <Eigen/Core>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxLegs = 5'000;

struct Field {
  const char* pointer;
  const char* name;
  const char* unit;
};
constexpr Field kLegFields[] = {{"/length_m", "length", "m"},
                                {"/clearance_m", "clearance", "m"},
                                {"/margin_sigma", "margin", "sigma"},
                                {"/arrives_s", "arrival", "s"},
                                {"/way_out/duration_s", "exit path", "s"},
                                {"/way_out/latest_s", "turn by", "s"}};
constexpr Field kBudgetFields[] = {{"/budget/distance_m", "distance", "m"},
                                   {"/budget/duration_s", "duration", "s"},
                                   {"/budget/energy_wh", "energy", "Wh"},
                                   {"/budget/worst_duration_s", "worst duration", "s"},
                                   {"/budget/worst_energy_wh", "worst energy", "Wh"},
                                   {"/exit_path/longest_m", "longest exit path", "m"},
                                   {"/exit_path/clearance_m", "exit path's clearance", "m"},
                                   {"/dives/dives", "simulated dives", ""},
                                   {"/dives/successes", "successful dives", ""},
                                   {"/dives/collisions", "dives with a collision", ""},
                                   {"/dives/clearance_m/min", "least clearance of the dives", "m"}};

const Json& at(const Json& json, const char* pointer) {
  static const Json kNothing;
  const Json::json_pointer path(pointer);
  return json.contains(path) ? json.at(path) : kNothing;
}

std::optional<double> number_at(const Json& json, const char* pointer) {
  const Json& value = at(json, pointer);
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

std::string text_at(const Json& json, const char* pointer) {
  const Json& value = at(json, pointer);
  return value.is_string() ? value.get<std::string>() : std::string();
}

template <std::size_t N>
std::vector<Quantity> quantities_of(const Json& a, const Json& b, const Field (&fields)[N]) {
  std::vector<Quantity> list;
  for (const auto& [pointer, name, unit] : fields) {
    Quantity quantity{name, unit, number_at(a, pointer), number_at(b, pointer)};
    if (quantity.a || quantity.b) list.push_back(std::move(quantity));
  }
  return list;
}

std::vector<Eigen::Vector3d> path_of(const Json& leg) {
  std::vector<Eigen::Vector3d> path;
  const Json& waypoints = at(leg, "/waypoints");
  if (!waypoints.is_array()) return path;
  for (const Json& pose : waypoints) {
    const bool is_pose = pose.is_array() && pose.size() >= 3 && pose[0].is_number() &&
                         pose[1].is_number() && pose[2].is_number();
    if (!is_pose) return {};
    path.emplace_back(pose[0].get<double>(), pose[1].get<double>(), pose[2].get<double>());
  }
  return path;
}

double distance_to(const std::vector<Eigen::Vector3d>& path, const Eigen::Vector3d& p) {
  double least = (path.front() - p).norm();
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d along = path[i] - path[i - 1];
    const double length2 = along.squaredNorm();
    const double t =
        length2 > 0.0 ? std::clamp((p - path[i - 1]).dot(along) / length2, 0.0, 1.0) : 0.0;
    least = std::min(least, (path[i - 1] + t * along - p).norm());
  }
  return least;
}

std::optional<double> apart(const Json& a, const Json& b) {
  const std::vector<Eigen::Vector3d> path_a = path_of(a);
  const std::vector<Eigen::Vector3d> path_b = path_of(b);
  if (path_a.empty() || path_b.empty()) return std::nullopt;
  double greatest = 0.0;
  for (const Eigen::Vector3d& p : path_a) greatest = std::max(greatest, distance_to(path_b, p));
  for (const Eigen::Vector3d& p : path_b) greatest = std::max(greatest, distance_to(path_a, p));
  return greatest;
}

// A leg's name: a goal that the route visits again is another leg.
std::vector<std::string> names_of(const Json& plans) {
  std::map<std::string, int> count;
  std::vector<std::string> names;
  for (const Json& leg : plans) {
    const std::string name = fmt::format("{}\n{}", text_at(leg, "/state"), text_at(leg, "/goal"));
    names.push_back(fmt::format("{}\n{}", name, ++count[name]));
  }
  return names;
}

LegComparison compare_legs(const Json* a, const Json* b) {
  static const Json kNothing = Json::object();
  const Json& either = a != nullptr ? *a : *b;
  LegComparison leg{text_at(either, "/state"), text_at(either, "/goal"), {}, {}, {}, {}};
  if (a != nullptr) leg.status_a = text_at(*a, "/status");
  if (b != nullptr) leg.status_b = text_at(*b, "/status");
  leg.quantities =
      quantities_of(a != nullptr ? *a : kNothing, b != nullptr ? *b : kNothing, kLegFields);
  if (a != nullptr && b != nullptr) leg.apart_m = apart(*a, *b);
  return leg;
}

std::set<std::pair<std::string, std::string>> findings_of(const Json& json) {
  std::set<std::pair<std::string, std::string>> findings;
  const Json& list = at(json, "/diagnostics");
  if (!list.is_array()) return findings;
  for (const Json& each : list) {
    findings.emplace(fmt::format("{} {}", text_at(each, "/severity"), text_at(each, "/code")),
                     text_at(each, "/message"));
  }
  return findings;
}

void compare_findings(const Json& a, const Json& b, std::vector<Difference>& differences) {
  const Json& ok_a = at(a, "/ok");
  const Json& ok_b = at(b, "/ok");
  if (!ok_a.is_boolean() || !ok_b.is_boolean()) return;
  const auto ready = [](const Json& ok) { return ok.get<bool>() ? "yes" : "no"; };
  if (ok_a != ok_b) differences.push_back({"ready to dive", ready(ok_a), ready(ok_b)});
  const auto of_a = findings_of(a);
  const auto of_b = findings_of(b);
  for (const auto& [what, message] : of_a) {
    if (!of_b.contains({what, message})) differences.push_back({what, message, ""});
  }
  for (const auto& [what, message] : of_b) {
    if (!of_a.contains({what, message})) differences.push_back({what, "", message});
  }
}

}  // namespace

bool LegComparison::differs() const {
  return status_a != status_b || std::ranges::any_of(quantities, &Quantity::differs) ||
         apart_m.value_or(0.0) > 0.0;
}

bool PlanComparison::differs() const {
  return !findings.empty() || std::ranges::any_of(legs, &LegComparison::differs) ||
         std::ranges::any_of(budget, &Quantity::differs);
}

PlanComparison compare_plans(const Json& a, const Json& b) {
  PlanComparison comparison;
  const Json& plans_a = at(a, "/plans");
  const Json& plans_b = at(b, "/plans");
  const std::vector<std::string> names_a = names_of(plans_a);
  const std::vector<std::string> names_b = names_of(plans_b);
  for (std::size_t i = 0; i < names_a.size(); ++i) {
    const auto other = std::ranges::find(names_b, names_a[i]);
    const auto index = static_cast<std::size_t>(other - names_b.begin());
    comparison.legs.push_back(
        compare_legs(&plans_a[i], other == names_b.end() ? nullptr : &plans_b[index]));
  }
  for (std::size_t i = 0; i < names_b.size(); ++i) {
    if (std::ranges::find(names_a, names_b[i]) != names_a.end()) continue;
    comparison.legs.push_back(compare_legs(nullptr, &plans_b[i]));
  }
  comparison.budget = quantities_of(a, b, kBudgetFields);
  compare_findings(a, b, comparison.findings);
  return comparison;
}

tl::expected<Json, std::string> parse_plan(const std::string& text) {
  Json json = Json::parse(text, nullptr, false);
  if (json.is_object() && !json.contains("plans") && json.contains("status") &&
      json.contains("clearance_m")) {
    Json plan = std::move(json);
    json = Json::object();
    json["plans"] = Json::array({std::move(plan)});
  }
  const Json& plans = at(json, "/plans");
  const bool is_plan = plans.is_array() && plans.size() <= kMaxLegs &&
                       std::ranges::all_of(plans, [](const Json& leg) {
                         return leg.is_object() && at(leg, "/status").is_string();
                       });
  if (is_plan) return tl::expected<Json, std::string>(std::move(json));
  return tl::unexpected(std::string(
      "it is not the JSON of a plan: dive plan --json and dive check --json print one"));
}

}  // namespace dive::mission
