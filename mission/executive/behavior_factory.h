#pragma once
// Converts a mission's values to the settings of its behaviours and of what runs beside them. The
// behaviours themselves are made in mission/states.

#include <cstdint>

#include "behaviors/failsafes.h"
#include "behaviors/leg.h"
#include "behaviors/monitors.h"
#include "behaviors/stopping_speed.h"
#include "mission/document/mission.h"
#include "planning/mapping/mapper.h"
#include "planning/planner.h"
#include "planning/world/scene.h"

namespace dive::mission {

/// Inputs shared by all atomic states of a mission.
struct BehaviorContext {
  const Mission* mission = nullptr;
  behaviors::LegSettings leg;
  const planning::Scene* scene = nullptr;  ///< World for positions given as altitude.
};

[[nodiscard]] BehaviorContext make_behavior_context(const Mission& mission,
                                                    const planning::Scene& scene,
                                                    std::uint64_t seed);

/// The settings of the legs of `spec`: the mission's, except where the state has its own.
[[nodiscard]] behaviors::LegSettings leg_settings(const BehaviorContext& context,
                                                  const StateSpec& spec);

/// Speed limit in an unknown environment as a function of the free distance ahead.
[[nodiscard]] behaviors::StoppingSpeedOptions stopping_speed_options(const Mission& mission);

/// Clearance (m) up to which paths are evaluated against the observed map: above every clearance
/// that the mission requires.
[[nodiscard]] double evaluated_clearance(const Mission& mission);

/// The vehicle's map when the dive begins: empty in an unknown environment. Used by the executive
/// and its planner.
[[nodiscard]] planning::World known_world(const Mission& mission, planning::World world);

/// In an unknown environment paths climb no steeper than the sensor's field of view allows.
[[nodiscard]] planning::PlannerOptions planner_options(const Mission& mission,
                                                       const planning::World& known,
                                                       planning::PlannerOptions options);

/// Sets the memory of the observed map to the mission's value.
[[nodiscard]] planning::MapperOptions mapper_options(const Mission& mission,
                                                     planning::MapperOptions options);

[[nodiscard]] behaviors::MonitorLimits monitor_limits(const Mission& mission);

}  // namespace dive::mission
