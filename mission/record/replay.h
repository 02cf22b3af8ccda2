#pragma once
// Re-runs a log: the same inputs into a new executive, its outputs against those logged, bit for
// bit.

#include <cstdint>
#include <string>

#include <tl/expected.hpp>

#include "common/clock.h"
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

}  // namespace dive::mission
