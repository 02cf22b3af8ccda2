#pragma once
// Settings of the loop on board, the same for a vehicle and for the simulator.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/operator_command.h"
#include "common/tag.h"
#include "mission/document/mission.h"
#include "mission/executive/executive.h"
#include "mission/onboard/loop_service.h"
#include "planning/mapping/mapper.h"
#include "planning/planner.h"
#include "planning/world/world.h"

namespace dive::mission {

inline constexpr Utime kControlPeriod = 20'000;  ///< us between two ticks: 50 Hz.

/// Each latency is in ticks, from a measurement or request to its answer: a minimum on a vehicle,
/// exact in simulation.
struct OnboardSettings {
  std::uint64_t seed = 1;
  std::optional<Resume> resume;
  planning::PlannerOptions planner;
  int planner_latency_ticks = 5;  ///< 100 ms
  // In an unknown environment:
  planning::MapperOptions mapper;
  int mapper_latency_ticks = 2;  ///< 40 ms
  // In a known map:
  int fix_latency_ticks = 5;  ///< 100 ms
  // With the visual-inertial estimator:
  int vision_latency_ticks = 4;  ///< 80 ms
  int loop_latency_ticks = 20;   ///< 400 ms
  /// An abort commanded on this computer; asked in every tick with a position, whose other command
  /// it replaces. Empty: never.
  std::function<std::optional<OperatorCommand>()> local_abort = {};

  /// Empty if usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// 1.5 times the mission's timeout, and the time of an abort that starts at its end, s.
[[nodiscard]] double longest_dive_s(const Mission& mission);

/// The mission's tags, in W.
[[nodiscard]] std::vector<Tag> known_tags(const Mission& mission, const planning::World& world);

/// Loop closure of a mission that uses it, with the latency from a keyframe to its answer, us.
/// In an unknown environment it moves the observed map. Empty with tags, whose corrections it would
/// repeat.
[[nodiscard]] std::optional<LoopSettings> loop_settings(const Mission& mission, Utime latency);

}  // namespace dive::mission
