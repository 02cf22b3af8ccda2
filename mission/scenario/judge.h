#pragma once
// Holds what came of a dive against what was expected.

#include <string>
#include <vector>

#include "mission/scenario/dive_record.h"
#include "mission/scenario/scenario.h"

namespace dive::mission {

struct Judgement {
  bool holds = false;
  std::string expected;  ///< In words ...
  std::string seen;      ///< ... and what there was instead, or as well.
  Span span;             ///< In the scenario's file.
};

/// One for each of the scenario's expectations, in their order.
[[nodiscard]] std::vector<Judgement> judge(const Scenario& scenario, const DiveRecord& record);

/// The opposite of an expectation.
[[nodiscard]] Expectation turned_round(Expectation expectation);

/// Judges the dive anew with one expectation after the other turned round, and returns those with
/// which the scenario would still have held: they expect nothing. Asked of a dive that held.
[[nodiscard]] std::vector<Judgement> holds_turned_round(const Scenario& scenario,
                                                        const DiveRecord& record);

}  // namespace dive::mission
