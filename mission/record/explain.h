#pragma once
// Why a dive went as it did: every transition with its cause and the guards that decided it, every
// change of the failsafe ladder with what competed for it, every plan with why it was asked for.

#include <string>
#include <vector>

#include "mission/record/log.h"

namespace dive::mission {

struct Explained {
  enum class Kind { kTransition, kFailsafe, kPlan, kAnswer, kAction, kOperator, kMap } kind;
  double t_s = 0.0;
  std::string state;    ///< Innermost active state at the end of that tick.
  std::string what;     ///< One line.
  std::string because;  ///< What decided it; may be empty.
};

struct Explanation {
  std::vector<Explained> events;
  double duration_s = 0.0;
  bool torn = false;
};

/// Reads the log to its end.
[[nodiscard]] Explanation explain(LogReader& log);

[[nodiscard]] const char* to_string(Explained::Kind kind);

}  // namespace dive::mission
