#include "mission/cli/diff_output.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/terminal.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;

std::string shown(const std::optional<double>& value) {
  return value ? fmt::format("{:.2f}", *value) : "-";
}

std::string or_absent(const std::string& value) { return value.empty() ? "(absent)" : value; }

void print_quantity(const Quantity& quantity, const char* indent) {
  const std::string change =
      quantity.differs() ? fmt::format("  ({:+.2g})", *quantity.b - *quantity.a) : "";
  print(fmt::format("{}{} {:<28} {:>10} {:>10} {}{}", indent, quantity.differs() ? '*' : ' ',
                    quantity.name, shown(quantity.a), shown(quantity.b), quantity.unit, change));
}

void print_decision(const char* name, const std::optional<Decision>& decision) {
  if (!decision) {
    print(fmt::format("  {} decides nothing more", name));
    return;
  }
  print(fmt::format("  {} {:8.2f} s  {} {}", name, decision->t_s, decision->kind, decision->what));
  if (!decision->cause.empty()) print(fmt::format("                {}", decision->cause));
}

Json json_of(const std::optional<Decision>& decision) {
  if (!decision) return nullptr;
  return {{"t", decision->t_s},
          {"kind", decision->kind},
          {"what", decision->what},
          {"cause", decision->cause}};
}

Json json_of(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }
Json json_of(const std::optional<std::string>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json json_of(const std::vector<Quantity>& quantities) {
  Json list = Json::array();
  for (const Quantity& each : quantities) {
    list.push_back({{"name", each.name},
                    {"unit", each.unit},
                    {"a", json_of(each.a)},
                    {"b", json_of(each.b)},
                    {"different", each.differs()}});
  }
  return list;
}

}  // namespace

void print_differences(const char* title, const std::vector<Difference>& differences) {
  if (differences.empty()) return;
  print(title);
  for (const auto& [what, a, b] : differences) {
    print(fmt::format("  * {}: {} | {}", what, or_absent(a), or_absent(b)));
  }
}

void print_comparison(const LogComparison& comparison) {
  print_differences("dives", comparison.header);
  if (comparison.decides_otherwise()) {
    print(fmt::format("the first decision that differs, after {} in common",
                      comparison.common_decisions));
    if (const auto& last = comparison.last_common) {
      print(fmt::format("    {:8.2f} s  {} {} (in common)", last->t_s, last->kind, last->what));
    }
    print_decision("A", comparison.a);
    print_decision("B", comparison.b);
  } else {
    print(fmt::format("the same {} decisions", comparison.common_decisions));
  }
  // Without a decision that differs, all inputs that differ; else those up to it.
  double until_s = std::max(comparison.duration_a_s, comparison.duration_b_s);
  if (comparison.decides_otherwise()) {
    until_s = std::min(comparison.a ? comparison.a->t_s : until_s,
                       comparison.b ? comparison.b->t_s : until_s);
  }
  bool is_first = true;
  for (const auto& [input, t_s, a, b] : comparison.inputs) {
    if (t_s > until_s) continue;
    if (is_first) print("inputs that differ, each for the first time");
    is_first = false;
    print(fmt::format("    {:8.2f} s  {}: {} | {}", t_s, input, or_absent(a), or_absent(b)));
  }
  if (is_first && comparison.decides_otherwise()) print("no input differs before it");
  if (!comparison.output.empty()) print("the first output that differs, " + comparison.output);
  if (comparison.is_damaged) note("dive: a log is damaged or torn: see dive replay");
}

void print_comparison(const PlanComparison& comparison) {
  print(fmt::format("legs {:>40} {:>10}", "A", "B"));
  for (const LegComparison& leg : comparison.legs) {
    print(fmt::format(
        "{} {} in {}: {}", leg.differs() ? '*' : ' ', leg.goal.empty() ? "the path" : leg.goal,
        leg.state.empty() ? "it" : leg.state,
        leg.status_a == leg.status_b ? leg.status_a.value_or("")
                                     : fmt::format("{} | {}", leg.status_a.value_or("(absent)"),
                                                   leg.status_b.value_or("(absent)"))));
    for (const Quantity& each : leg.quantities) print_quantity(each, "    ");
    if (leg.apart_m.value_or(0.0) > 0.0) {
      print(fmt::format("    * the paths are up to {:.2f} m apart", *leg.apart_m));
    }
  }
  if (!comparison.budget.empty()) print("budget");
  for (const Quantity& each : comparison.budget) print_quantity(each, "    ");
  print_differences("results", comparison.findings);
}

Json to_json(const std::vector<Difference>& differences) {
  Json list = Json::array();
  for (const auto& [what, a, b] : differences) {
    list.push_back({{"what", what}, {"a", a}, {"b", b}});
  }
  return list;
}

Json to_json(const LogComparison& comparison) {
  Json inputs = Json::array();
  for (const auto& [input, t_s, a, b] : comparison.inputs) {
    inputs.push_back({{"input", input}, {"t", t_s}, {"a", a}, {"b", b}});
  }
  return {{"kind", "logs"},
          {"equal", comparison.is_equal},
          {"header", to_json(comparison.header)},
          {"common_decisions", comparison.common_decisions},
          {"decision", {{"a", json_of(comparison.a)}, {"b", json_of(comparison.b)}}},
          {"inputs", std::move(inputs)},
          {"output", comparison.output},
          {"duration_s", {{"a", comparison.duration_a_s}, {"b", comparison.duration_b_s}}},
          {"damaged", comparison.is_damaged}};
}

Json to_json(const PlanComparison& comparison) {
  Json legs = Json::array();
  for (const LegComparison& leg : comparison.legs) {
    legs.push_back({{"state", leg.state},
                    {"goal", leg.goal},
                    {"different", leg.differs()},
                    {"status", {{"a", json_of(leg.status_a)}, {"b", json_of(leg.status_b)}}},
                    {"quantities", json_of(leg.quantities)},
                    {"apart_m", json_of(leg.apart_m)}});
  }
  return {{"legs", std::move(legs)},
          {"budget", json_of(comparison.budget)},
          {"findings", to_json(comparison.findings)}};
}

}  // namespace dive::mission
