#pragma once
// A command from topside.

#include <array>
#include <cstddef>

namespace dive {

enum class OperatorCommand { kHeartbeat, kAbort, kPause, kResume, kSkip };

inline constexpr std::array<const char*, 5> kOperatorCommandNames = {"heartbeat", "abort", "pause",
                                                                     "resume", "skip"};

[[nodiscard]] constexpr const char* to_string(OperatorCommand command) {
  return kOperatorCommandNames[static_cast<std::size_t>(command)];
}

}  // namespace dive
