#pragma once
// Replays a log: the same inputs to a new executive, its outputs compared with the logged ones, bit
// for bit. A log can be replayed up to its first gap, because the inputs in the gap are lost.

#include <cstdint>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "mission/document/mission.h"
#include "mission/record/log.h"

namespace dive::mission {

struct ReplayReport {
  bool identical = false;        ///< Every output is identical, and the log has no gap.
  std::int64_t ticks = 0;        ///< Ticks in the log.
  std::int64_t replayed = 0;     ///< Ticks replayed.
  std::int64_t events = 0;       ///< Events in the log.
  std::vector<LogGap> gaps;      ///< Gaps in the log.
  bool torn = false;             ///< The log ends in the middle of a tick.
  std::string first_divergence;  ///< "t = 12.34 s: channel.field: logged A, replayed B".
};

/// The error is a sentence: the log's mission, map or vehicle cannot be read any more. A log with a
/// damaged header is not replayed.
[[nodiscard]] tl::expected<ReplayReport, std::string> replay(LogReader& log);

/// The hypothetical course of another mission if the vehicle and the planner had behaved as they
/// did: its transitions beside the logged ones. The comparison loses value with the distance from
/// the first divergence. Also fails if the log's header is damaged.
struct WhatIf {
  ReplayReport report;
  std::vector<TimedTransition> logged;
  std::vector<TimedTransition> replayed;
};
[[nodiscard]] tl::expected<WhatIf, std::string> replay_with(LogReader& log, const Mission& changed);

}  // namespace dive::mission
