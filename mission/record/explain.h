#pragma once
// The course of a dive and its causes: every transition with its cause and the guards that decided
// it, every change of the failsafe ladder with the competing failsafes, every plan with the reason
// of its request, every collision of a simulated vehicle, and every gap in the log.

#include <string>
#include <vector>

#include "mission/record/collision.h"
#include "mission/record/log.h"

namespace dive::mission {

struct Explained {
  enum class Kind {
    kTransition,
    kFailsafe,
    kPlan,
    kAnswer,
    kAction,
    kOperator,
    kMap,
    kCollision,
    kGap
  } kind;
  double t_s = 0.0;
  std::string state;   ///< Innermost active state at the end of that tick.
  std::string what;    ///< One line.
  std::string reason;  ///< Cause; may be empty.
};

struct Explanation {
  std::vector<Explained> events;
  std::vector<Collision> collisions;  ///< Empty without ground truth in the log.
  double duration_s = 0.0;
  std::vector<LogGap> gaps;  ///< Each gap is also an event.
  bool torn = false;
};

/// Reads the log to its end.
[[nodiscard]] Explanation explain(LogReader& log);

[[nodiscard]] const char* to_string(Explained::Kind kind);

}  // namespace dive::mission
