#pragma once
// What the loop on board is set to by the mission, for a vehicle and for a simulated one alike.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/tag.h"
#include "mission/document/mission.h"
#include "mission/executive/executive.h"
#include "mission/onboard/loop_service.h"
#include "planning/mapping/mapper.h"
#include "planning/planner.h"
#include "planning/world/world.h"

namespace dive::mission {

inline constexpr Utime kControlPeriod = 20'000;  ///< us between two ticks: 50 Hz.

/// Each latency is in ticks, from a measurement or query to its answer: at least as long on a
/// vehicle, exactly as long in simulation.
struct OnboardSettings {
  std::uint64_t seed = 1;
  std::optional<Resume> resume;
  planning::PlannerOptions planner;
  int planner_latency_ticks = 5;  ///< 100 ms
  // In unknown water:
  planning::MapperOptions mapper;
  int mapper_latency_ticks = 2;  ///< 40 ms
  // With the visual-inertial estimator:
  int vision_latency_ticks = 4;  ///< 80 ms
  int loop_latency_ticks = 20;   ///< 400 ms

  /// Empty when usable, else a sentence that names the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// Half as long again as the mission may last, and the time of an abort that starts at its end.
[[nodiscard]] double longest_dive_s(const Mission& mission);

/// The mission's tags, in W.
[[nodiscard]] std::vector<Tag> known_tags(const Mission& mission, const planning::World& world);

/// Loop closure of a mission that asks for it, with a latency from a keyframe to its answer;
/// nothing in unknown water and where there are tags, whose corrections it would repeat.
[[nodiscard]] std::optional<LoopSettings> loop_settings(const Mission& mission, Utime latency);

}  // namespace dive::mission
