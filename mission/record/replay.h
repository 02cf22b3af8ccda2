#pragma once
// Replays a log: the same inputs to a new executive, its outputs compared with the logged ones, bit
// for bit. A log can be replayed up to its first gap, because the inputs in the gap are lost. A log
// that was made with other mathematics (common/mathematics.h) can be replayed, but a difference
// from it says nothing about the executive.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "mission/document/mission.h"
#include "mission/executive/executive.h"
#include "mission/record/log.h"
#include "planning/world/mesh_source.h"
#include "planning/world/world.h"
#include "vehicle/model.h"

namespace dive::mission {

struct ReplayReport {
  bool identical = false;     ///< Every output is identical, and the log has no gap.
  std::int64_t ticks = 0;     ///< Ticks in the log.
  std::int64_t replayed = 0;  ///< Ticks replayed.
  std::int64_t events = 0;    ///< Events in the log.
  std::vector<LogGap> gaps;   ///< Gaps in the log.
  bool torn = false;          ///< The log ends in the middle of a tick.
  /// "t = 12.34 s: channel.field: logged A, replayed B". Empty if the mathematics differ.
  std::string first_divergence;
  /// The same where the log was made with other mathematics: the log can be verified only by a
  /// process with the mathematics of the log. Empty if the mathematics are the same.
  std::string mathematics_difference;
  std::string logged_mathematics;    ///< Mathematics of the log; empty if its header is damaged.
  std::string replayed_mathematics;  ///< mathematics() of this process.
};

/// The error is a sentence: the log's mission, map or vehicle cannot be read any more. A log with a
/// damaged header is not replayed.
[[nodiscard]] tl::expected<ReplayReport, std::string> replay(LogReader& log);

/// The mission, map and vehicle of a log.
struct LoggedDive {
  Mission mission;
  planning::World map;  ///< In an unknown environment: the world of the simulation.
  vehicle::Model model;
  ExecutiveOptions options;
};
/// The error is a sentence: one of them cannot be read any more. Without `meshes`, those of the
/// header.
[[nodiscard]] tl::expected<LoggedDive, std::string> logged_dive(const LogHeader& header);
[[nodiscard]] tl::expected<LoggedDive, std::string> logged_dive(const LogHeader& header,
                                                                planning::MeshSource& meshes);

/// Called with every tick of the log, and with the executive after that tick; null from the first
/// gap or divergence on.
using ReplayObserver = std::function<void(const LoggedTick&, const Executive*)>;
/// Replays a log and shows each tick to `observer`. `dive` is that of the log.
[[nodiscard]] ReplayReport replay(LogReader& log, const LoggedDive& dive,
                                  const ReplayObserver& observer);

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
