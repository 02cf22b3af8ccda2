#pragma once
// What the recording of a dive has lost.

#include <cstdint>

namespace dive::mission {

/// Numbers since the dive began.
struct RecordingLoss {
  std::int64_t ticks = 0;     ///< Ticks missing in the log.
  std::int64_t commits = 0;   ///< Commits missing in the journal.
  std::int64_t commands = 0;  ///< Payload commands not sent, because the journal did not get them.

  friend bool operator==(const RecordingLoss&, const RecordingLoss&) = default;
};

}  // namespace dive::mission
