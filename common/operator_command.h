#pragma once
// A command of an operator: from topside, or a signal to the executive's process, which aborts the
// dive.

#include <array>
#include <cstddef>

namespace dive {

enum class OperatorCommand { kHeartbeat, kAbort, kPause, kResume, kSkip, kSigterm, kSigint };

/// The commands up to this one come from topside; signals do not.
inline constexpr OperatorCommand kLastTopsideCommand = OperatorCommand::kSkip;

inline constexpr std::array<const char*, 7> kOperatorCommandNames = {
    "heartbeat", "abort", "pause", "resume", "skip", "SIGTERM", "SIGINT"};

[[nodiscard]] constexpr const char* to_string(OperatorCommand command) {
  return kOperatorCommandNames[static_cast<std::size_t>(command)];
}

}  // namespace dive
