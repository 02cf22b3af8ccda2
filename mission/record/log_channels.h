#pragma once
// The channels of a dive log, in the order in which a tick is written.

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

namespace dive::mission {

enum class Channel {
  kHeader,  ///< The first event, once.
  kAhrs,    ///< Inputs, where present.
  kDepth,
  kHealth,
  kPlan,
  kOperator,
  kObstacles,  ///< Once for each source.
  kFreeAhead,
  kObstacleAhead,
  kPoseCorrection,
  kMapCorrection,
  kMapFix,
  kVision,
  kLoss,
  kCommand,  ///< Outputs of every tick.
  kRates,
  kEstimate,
  kStatus,
  kPlanQuery,   ///< Outputs of some ticks.
  kTransition,  ///< Outputs in any number.
  kFailsafe,
  kAction,
  kTruth,  ///< Data of the simulator only.
  kTick,   ///< End of the tick.
};

inline constexpr std::array<std::string_view, 24> kChannelNames = {"DIVE_HEADER",
                                                                   "DIVE_IN_AHRS",
                                                                   "DIVE_IN_DEPTH",
                                                                   "DIVE_IN_HEALTH",
                                                                   "DIVE_IN_PLAN",
                                                                   "DIVE_IN_OPERATOR",
                                                                   "DIVE_IN_OBSTACLES",
                                                                   "DIVE_IN_FREE_AHEAD",
                                                                   "DIVE_IN_OBSTACLE_AHEAD",
                                                                   "DIVE_IN_POSE_CORRECTION",
                                                                   "DIVE_IN_MAP_CORRECTION",
                                                                   "DIVE_IN_MAP_FIX",
                                                                   "DIVE_IN_VISION",
                                                                   "DIVE_IN_LOSS",
                                                                   "DIVE_OUT_COMMAND",
                                                                   "DIVE_OUT_RATES",
                                                                   "DIVE_OUT_ESTIMATE",
                                                                   "DIVE_OUT_STATUS",
                                                                   "DIVE_OUT_PLAN_QUERY",
                                                                   "DIVE_OUT_TRANSITION",
                                                                   "DIVE_OUT_FAILSAFE",
                                                                   "DIVE_OUT_ACTION",
                                                                   "DIVE_TRUTH",
                                                                   "DIVE_TICK"};

[[nodiscard]] constexpr std::string_view to_string(Channel channel) {
  return kChannelNames[static_cast<std::size_t>(channel)];
}

[[nodiscard]] constexpr std::optional<Channel> find_channel(std::string_view name) {
  for (std::size_t i = 0; i < kChannelNames.size(); ++i) {
    if (kChannelNames[i] == name) return static_cast<Channel>(i);
  }
  return std::nullopt;
}

/// Limit of events in one tick; more is not a valid log.
inline constexpr int kMaxEventsPerTick = 4096;

}  // namespace dive::mission
