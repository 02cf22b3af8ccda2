#include "mission/scenario/evaluation.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "common/assert.h"

namespace dive::mission {
namespace {

using Kind = Expectation::Kind;

constexpr std::size_t kMaxListed = 12;

std::string listed(const std::vector<std::string>& words) {
  const std::size_t shown = std::min(words.size(), kMaxListed);
  return fmt::format("{}{}",
                     fmt::join(words.begin(), words.begin() + static_cast<long>(shown), ", "),
                     words.size() > shown ? ", ..." : "");
}

// --- occurrences ---

Occurrence::Kind occurrence_kind(Kind kind) {
  switch (kind) {
    case Kind::kEnters:
      return Occurrence::Kind::kEntered;
    case Kind::kEvent:
      return Occurrence::Kind::kEvent;
    case Kind::kRung:
      return Occurrence::Kind::kRung;
    case Kind::kReplan:
      return Occurrence::Kind::kReplan;
    case Kind::kPayload:
      return Occurrence::Kind::kPayload;
    case Kind::kLine:
      return Occurrence::Kind::kLine;
    case Kind::kHeadsFor:
      return Occurrence::Kind::kHeading;
    default:
      return Occurrence::Kind::kStep;
  }
}

bool is_what(const Occurrence& occurrence, const Expectation& expected) {
  if (expected.kind == Kind::kStepHappens) return occurrence.step == expected.step;
  if (expected.kind == Kind::kLine) {
    return occurrence.name.find(expected.name.value) != std::string::npos;
  }
  return occurrence.name == expected.name.value &&
         (expected.cause.empty() || occurrence.cause == expected.cause);
}

std::string name_of(const Occurrence& occurrence) {
  const bool has_cause = !occurrence.cause.empty();
  return has_cause ? fmt::format("{} ({})", occurrence.name, occurrence.cause) : occurrence.name;
}

std::optional<double> time_of_step(const DiveRecord& record, const std::string& id) {
  for (const Occurrence& occurrence : record.occurrences) {
    if (occurrence.kind == Occurrence::Kind::kStep && occurrence.name == id) return occurrence.t_s;
  }
  return std::nullopt;
}

std::string describe_when(const Expectation& expected) {
  std::string text;
  if (expected.times) text += fmt::format(" {} time(s)", *expected.times);
  if (expected.within_s) text += fmt::format(" within {:g} s", expected.within_s->value);
  if (!expected.after.value.empty()) text += fmt::format(" after '{}'", expected.after.value);
  return text;
}

std::string describe_moment(const Expectation& expected) {
  const std::string& name = expected.name.value;
  switch (expected.kind) {
    case Kind::kStepHappens:
      return "this step happens";
    case Kind::kEnters:
      return fmt::format("state {} is entered", name);
    case Kind::kEvent:
      return fmt::format("event {} is acted upon", name);
    case Kind::kRung:
      return fmt::format("rung {}{}", name,
                         expected.cause.empty() ? "" : " because of " + expected.cause);
    case Kind::kReplan:
      return fmt::format("a replan because of {}", name);
    case Kind::kPayload:
      return fmt::format("payload {}", name);
    case Kind::kLine:
      return fmt::format("a line with '{}'", name);
    default:
      return fmt::format("the vehicle heads for {}", name);
  }
}

// The time of the occurrence, or else the occurrences in the relevant period.
std::string describe_moments(const DiveRecord& record, const Expectation& expected, double from_s) {
  std::vector<std::string> times;
  std::vector<std::string> others;
  const Occurrence::Kind kind = occurrence_kind(expected.kind);
  for (const Occurrence& occurrence : record.occurrences) {
    if (occurrence.kind != kind || occurrence.t_s < from_s) continue;
    if (is_what(occurrence, expected)) {
      times.push_back(fmt::format("{:.2f}", occurrence.t_s - from_s));
    } else if (const std::string name = name_of(occurrence);
               !name.empty() && std::ranges::find(others, name) == others.end()) {
      others.push_back(name);
    }
  }
  if (!times.empty()) {
    return fmt::format("{} time(s), after {} s", times.size(), listed(times));
  }
  if (expected.kind == Kind::kStepHappens) return "its trigger never came";
  return others.empty() ? "nothing of that kind" : fmt::format("never; but {}", listed(others));
}

ExpectationResult judge_moments(const DiveRecord& record, const Expectation& expected) {
  ExpectationResult result;
  result.expected = describe_moment(expected) + describe_when(expected);
  double from_s = 0.0;
  if (!expected.after.value.empty()) {
    const std::optional<double> at = time_of_step(record, expected.after.value);
    if (!at) {  // neither met nor negated
      result.actual = fmt::format("'{}' never happened", expected.after.value);
      return result;
    }
    from_s = *at;
  }
  const double to_s = from_s + (expected.within_s ? expected.within_s->value : HUGE_VAL);
  const Occurrence::Kind kind = occurrence_kind(expected.kind);
  const auto count = std::ranges::count_if(record.occurrences, [&](const Occurrence& occurrence) {
    return occurrence.kind == kind && occurrence.t_s >= from_s && occurrence.t_s <= to_s &&
           is_what(occurrence, expected);
  });
  const bool is_so = expected.times ? count == *expected.times : count > 0;
  result.passed = is_so != expected.negated;
  result.actual = describe_moments(record, expected, from_s);
  return result;
}

// --- end of the dive ---

double quantity(const DiveRecord& record, const std::string& name) {
  const DiveResult& result = record.result;
  if (name == "collisions") return static_cast<double>(result.collisions.size());
  if (name == "min_clearance") return result.nearest.clearance_m;
  if (name == "diver_clearance") return result.diver_clearance_m;
  if (name == "max_depth") return record.max_depth_m;
  if (name == "final_depth") return result.final_depth_m;
  if (name == "duration") return result.duration_s;
  if (name == "distance") return result.distance_m;
  if (name == "energy") return result.energy_wh;
  if (name == "plans") return result.plans;
  if (name == "replans") return result.replans;
  if (name == "largest_step") return result.largest_step_m;
  if (name == "estimator_switches") return result.estimator_switches;
  DIVE_DEMAND(name == "position_error");  // the schema lists all values
  return result.final_error_m;
}

// The position at which a quantity was measured, if it has one.
std::string where_of(const DiveResult& result, const std::string& name) {
  if (name == "collisions") return describe(result.collisions);
  if (name == "min_clearance") return describe(result.nearest);
  return "";
}

ExpectationResult judge_bounds(const DiveRecord& record, const Expectation& expected) {
  const double value = quantity(record, expected.name.value);
  ExpectationResult result;
  result.expected = expected.name.value;
  if (expected.at_least) result.expected += fmt::format(" at least {:g}", expected.at_least->value);
  if (expected.at_most) result.expected += fmt::format(" at most {:g}", expected.at_most->value);
  const bool is_within = (!expected.at_least || value >= expected.at_least->value) &&
                         (!expected.at_most || value <= expected.at_most->value);
  result.passed = is_within != expected.negated;
  result.actual = fmt::format("{:.4g}", value);
  if (const std::string where = where_of(record.result, expected.name.value); !where.empty()) {
    result.actual += fmt::format(" ({})", where);
  }
  return result;
}

ExpectationResult judge_word(const Expectation& expected, const char* what,
                             const std::string& value) {
  ExpectationResult result;
  result.expected = fmt::format("{} {}", what, expected.name.value);
  result.passed = (value == expected.name.value) != expected.negated;
  result.actual = value;
  return result;
}

ExpectationResult judge_place(const Expectation& expected, const std::string& what, double away_m) {
  ExpectationResult result;
  result.expected = fmt::format("{} within {:g} m", what, expected.radius_m);
  result.passed = (away_m <= expected.radius_m) != expected.negated;
  result.actual = fmt::format("{:.2f} m away", away_m);
  return result;
}

ExpectationResult judge_one(const Expectation& expected, std::size_t index,
                            const DiveRecord& record) {
  const DiveResult& dive = record.result;
  switch (expected.kind) {
    case Kind::kOutcome: {
      ExpectationResult result = judge_word(expected, "outcome", dive.outcome);
      if (!dive.cause.empty()) result.actual += fmt::format(" ({})", dive.cause);
      return result;
    }
    case Kind::kFinalState:
      return judge_word(expected, "final state", dive.final_state);
    case Kind::kReaches:
      return judge_place(expected, "reaches " + expected.name.value, record.nearest_m.at(index));
    case Kind::kEndsNear:
      return judge_place(
          expected,
          fmt::format("ends near ({:g}, {:g})", expected.place_W.x(), expected.place_W.y()),
          (record.end_W - expected.place_W).head<2>().norm());
    case Kind::kBounds:
      return judge_bounds(record, expected);
    default:
      return judge_moments(record, expected);
  }
}

}  // namespace

std::vector<ExpectationResult> evaluate(const Scenario& scenario, const DiveRecord& record) {
  std::vector<ExpectationResult> results;
  for (std::size_t i = 0; i < scenario.expectations.size(); ++i) {
    const Expectation& expected = scenario.expectations[i];
    ExpectationResult result = judge_one(expected, i, record);
    if (expected.negated) result.expected = "not: " + result.expected;
    result.span = expected.span;
    results.push_back(std::move(result));
  }
  return results;
}

Expectation negate(Expectation expectation) {
  expectation.negated = !expectation.negated;
  return expectation;
}

std::vector<ExpectationResult> insensitive_expectations(const Scenario& scenario,
                                                        const DiveRecord& record) {
  std::vector<ExpectationResult> still;
  Scenario turned = scenario;
  for (Expectation& expectation : turned.expectations) {
    expectation = negate(expectation);
    const std::vector<ExpectationResult> results = evaluate(turned, record);
    const bool fails = !std::ranges::all_of(results, &ExpectationResult::passed);
    if (!fails) {
      still.push_back(results[static_cast<std::size_t>(&expectation - turned.expectations.data())]);
    }
    expectation = negate(expectation);
  }
  return still;
}

}  // namespace dive::mission
