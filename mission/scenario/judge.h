#pragma once
// Compares the actual result of a dive with the expected one.

#include <string>
#include <vector>

#include "mission/scenario/dive_record.h"
#include "mission/scenario/scenario.h"

namespace dive::mission {

struct Judgement {
  bool holds = false;
  std::string expected;  ///< Expected result, in words.
  std::string seen;      ///< Actual result, in words.
  Span span;             ///< Position in the scenario's file.
};

/// One result for each of the scenario's expectations, in their order.
[[nodiscard]] std::vector<Judgement> judge(const Scenario& scenario, const DiveRecord& record);

/// The negation of an expectation.
[[nodiscard]] Expectation turned_round(Expectation expectation);

/// Re-evaluates the dive with one negated expectation after the other, and returns those with which
/// the scenario would still have passed: they test nothing. Used on a dive that passed.
[[nodiscard]] std::vector<Judgement> holds_turned_round(const Scenario& scenario,
                                                        const DiveRecord& record);

}  // namespace dive::mission
