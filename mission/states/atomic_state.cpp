#include "mission/states/atomic_state.h"

#include <algorithm>

#include "common/assert.h"
#include "planning/world/sounding.h"

namespace dive::mission {

bool is_surfacing(const StateSpec& spec) {
  return spec.atomic && spec.atomic->end() == AtomicState::End::kAtTheSurface;
}

bool is_retracing(const StateSpec& spec) {
  return spec.atomic && spec.atomic->end() == AtomicState::End::kInOpenWater;
}

double ground_height(const planning::Scene& scene, const Position& position) {
  const Eigen::Vector3d at_surface(position.x.value, position.y.value, 0.0);
  return planning::ground_below(scene, at_surface).value_or(0.0);
}

behaviors::LegGoal leg_goal(const planning::Scene& scene, const Goal& goal) {
  behaviors::LegGoal leg;
  leg.id = goal.id.value;
  leg.position_W = goal.position.in_world(ground_height(scene, goal.position));
  if (goal.heading_deg) leg.yaw = heading_to_yaw(goal.heading_deg->value);
  leg.capture_radius = goal.capture_radius.value;
  leg.dwell_s = goal.dwell_s.value;
  return leg;
}

std::vector<behaviors::LegGoal> leg_goals(const planning::Scene& scene,
                                          const std::vector<Goal>& goals) {
  std::vector<behaviors::LegGoal> legs;
  for (const Goal& goal : goals) legs.push_back(leg_goal(scene, goal));
  return legs;
}

std::size_t first_goal(const BehaviorSetup& setup, std::size_t goals) {
  DIVE_DEMAND(setup.goals_done >= 0 && goals > 0);
  return std::min(static_cast<std::size_t>(setup.goals_done), goals - 1);
}

}  // namespace dive::mission
