#pragma once
// Two logs side by side: the first decision that differs, and the inputs that differ before it.
//
// A decision is what the executive decides in words: a transition, a change of the failsafe ladder,
// an action, a request for a plan. Decisions are compared in their order and by their content, not
// by their times: two dives with other errors of the sensors decide the same a little earlier or
// later. Commands differ as soon as any input does, and are reported apart.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "mission/diff/difference.h"
#include "mission/record/log.h"

namespace dive::mission {

struct Decision {
  double t_s = 0.0;
  std::string kind;   ///< "transition", "failsafe", "action" or "plan"
  std::string what;   ///< One line, without numbers that depend on measurements.
  std::string cause;  ///< Event, guards, competing failsafes; may be empty.
};

/// The first tick in which an input differs.
struct InputDifference {
  std::string input;  ///< Channel of the log, "DIVE_IN_DEPTH"; or "tick": the times of the ticks.
  double t_s = 0.0;
  std::string a;  ///< Its value, or "there"; empty: not in this tick.
  std::string b;
};

struct LogComparison {
  bool is_equal = false;  ///< Same headers, inputs and outputs, bit for bit.
  std::vector<Difference> header;
  std::size_t common_decisions = 0;  ///< Number of decisions before the first that differs.
  std::optional<Decision> last_common;
  /// The first decision that differs; absent: that log has no more, or all are the same.
  std::optional<Decision> a;
  std::optional<Decision> b;
  std::vector<InputDifference> inputs;  ///< Of each input the first; in the order of time.
  /// The first output of a tick that differs, with its time and both values; empty: none.
  std::string output;
  double duration_a_s = 0.0;
  double duration_b_s = 0.0;
  bool is_damaged = false;  ///< One of them has gaps, or ends within a tick.

  [[nodiscard]] bool decides_otherwise() const { return a || b; }
};

/// Reads both logs to their ends.
[[nodiscard]] LogComparison compare_logs(LogReader& a, LogReader& b);

}  // namespace dive::mission
