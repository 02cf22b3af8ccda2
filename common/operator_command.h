#pragma once
// A command of an operator: from topside, or a signal to the executive's process, which aborts the
// dive.

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

namespace dive {

enum class OperatorCommand { kHeartbeat, kAbort, kPause, kResume, kSkip, kSigterm, kSigint };

/// The commands up to this one come from topside; signals do not.
inline constexpr OperatorCommand kLastTopsideCommand = OperatorCommand::kSkip;
inline constexpr OperatorCommand kLastOperatorCommand = OperatorCommand::kSigint;

inline constexpr std::array<const char*, 7> kOperatorCommandNames = {
    "heartbeat", "abort", "pause", "resume", "skip", "SIGTERM", "SIGINT"};

[[nodiscard]] constexpr const char* to_string(OperatorCommand command) {
  return kOperatorCommandNames[static_cast<std::size_t>(command)];
}

/// The command from topside with that name.
[[nodiscard]] constexpr std::optional<OperatorCommand> find_operator_command(
    std::string_view name) {
  for (std::size_t i = 0; i <= static_cast<std::size_t>(kLastTopsideCommand); ++i) {
    if (kOperatorCommandNames[i] == name) return static_cast<OperatorCommand>(i);
  }
  return std::nullopt;
}

}  // namespace dive
