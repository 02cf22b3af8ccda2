#pragma once
// From what a mission says to what a behaviour needs.

#include <memory>

#include "behaviors/behavior.h"
#include "behaviors/failsafes.h"
#include "behaviors/leg.h"
#include "behaviors/monitors.h"
#include "behaviors/seen_ahead.h"
#include "mission/document/mission.h"
#include "planning/mapping/mapper.h"
#include "planning/world/scene.h"

namespace dive::mission {

/// What every leaf of a mission shares.
struct LeafContext {
  const Mission* mission = nullptr;
  behaviors::LegSettings leg;
  const planning::Scene* scene = nullptr;  ///< For positions given as altitude.
};

[[nodiscard]] LeafContext make_leaf_context(const Mission& mission, const planning::Scene& scene,
                                            std::uint64_t seed);

/// Height of the ground (z in W) below a position as written; the surface where there is none.
[[nodiscard]] double ground_height(const planning::Scene& scene, const Position& position);

[[nodiscard]] behaviors::LegGoal leg_goal(const LeafContext& context, const Goal& goal);

/// The settings of the legs of `spec`: the mission's, but for what the state says itself.
[[nodiscard]] behaviors::LegSettings leg_settings(const LeafContext& context,
                                                  const StateSpec& spec);

/// Surfacing, in unknown water from where there is room.
[[nodiscard]] std::unique_ptr<behaviors::Behavior> make_surface(const LeafContext& context);

/// The behaviour of a leaf state as written, but for its first `goals_done` goals; retrace is the
/// executive's own to make.
[[nodiscard]] std::unique_ptr<behaviors::Behavior> make_leaf_behavior(const LeafContext& context,
                                                                      const StateSpec& spec,
                                                                      int goals_done);

/// How the speed in unknown water depends on what is seen.
[[nodiscard]] behaviors::SeenAheadOptions seen_ahead_options(const Mission& mission);

/// Up to which clearance (m) paths are judged against what is seen: beyond all that the mission
/// asks for.
[[nodiscard]] double judged_clearance(const Mission& mission);

/// What the vehicle knows of its world when the dive begins: in unknown water, nothing. For the
/// executive and its planner.
[[nodiscard]] planning::World known_world(const Mission& mission, planning::World world);

/// In unknown water paths climb no steeper than the vehicle sees where it climbs to.
[[nodiscard]] planning::PlannerOptions planner_options(const Mission& mission,
                                                       planning::PlannerOptions options);

/// What was seen is remembered for as long as the mission says.
[[nodiscard]] planning::MapperOptions mapper_options(const Mission& mission,
                                                     planning::MapperOptions options);

[[nodiscard]] behaviors::MonitorLimits monitor_limits(const Mission& mission);

}  // namespace dive::mission
