#pragma once
// Compares the actual result of a dive with the expected one.

#include <string>
#include <vector>

#include "mission/scenario/dive_record.h"
#include "mission/scenario/scenario.h"

namespace dive::mission {

struct ExpectationResult {
  bool passed = false;
  std::string expected;  ///< Expected result, in words.
  std::string actual;    ///< Actual result, in words.
  Span span;             ///< Position in the scenario's file.
};

/// One result for each of the scenario's expectations, in their order.
[[nodiscard]] std::vector<ExpectationResult> evaluate(const Scenario& scenario,
                                                      const DiveRecord& record);

/// The negation of an expectation.
[[nodiscard]] Expectation negate(Expectation expectation);

/// Re-evaluates the dive with one negated expectation after the other, and returns those with which
/// the scenario would still have passed: they test nothing. Used on a dive that passed.
[[nodiscard]] std::vector<ExpectationResult> insensitive_expectations(const Scenario& scenario,
                                                                      const DiveRecord& record);

}  // namespace dive::mission
