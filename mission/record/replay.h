#pragma once
// Re-runs a log: the same inputs into a new executive, its outputs against those logged, bit for
// bit.

#include <cstdint>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "mission/document/mission.h"
#include "mission/record/log.h"

namespace dive::mission {

struct ReplayReport {
  bool identical = false;
  std::int64_t ticks = 0;
  std::int64_t events = 0;       ///< In the log.
  bool torn = false;             ///< The log ends in the middle of a tick.
  std::string first_divergence;  ///< "t = 12.34 s: channel.field: logged A, replayed B".
};

/// Fails with a sentence when the log's mission, map or vehicle cannot be read any more.
[[nodiscard]] tl::expected<ReplayReport, std::string> replay(LogReader& log);

/// What another mission would have done, had the vehicle and the planner behaved as they did: the
/// transitions beside those logged. The further from the first divergence, the less it is worth.
struct WhatIf {
  ReplayReport report;
  std::vector<TimedTransition> logged;
  std::vector<TimedTransition> replayed;
};
[[nodiscard]] tl::expected<WhatIf, std::string> replay_with(LogReader& log, const Mission& changed);

}  // namespace dive::mission
