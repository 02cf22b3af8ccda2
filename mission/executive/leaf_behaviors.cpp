#include "mission/executive/leaf_behaviors.h"

#include <utility>
#include <vector>

#include "behaviors/goal_sequence.h"
#include "behaviors/hold.h"
#include "behaviors/surface.h"
#include "common/assert.h"
#include "planning/world/sounding.h"

namespace dive::mission {
namespace {

behaviors::Rung ladder_rung(Rung rung) {
  switch (rung) {
    case Rung::kNone:
      return behaviors::Rung::kNone;
    case Rung::kWarn:
      return behaviors::Rung::kWarn;
    case Rung::kAbortAndSurface:
      return behaviors::Rung::kAbortAndSurface;
    case Rung::kEmergencySurface:
      return behaviors::Rung::kEmergencySurface;
  }
  DIVE_DEMAND(false);
}

}  // namespace

LeafContext make_leaf_context(const Mission& mission, const planning::Scene& scene,
                              std::uint64_t seed) {
  LeafContext context;
  context.scene = &scene;
  context.leg.speed = mission.speed.value;
  context.leg.clearance = mission.limits.clearance.value;
  context.leg.attitude = mission.attitude;
  context.leg.min_z = -mission.limits.max_depth.value;
  context.leg.min_altitude = mission.limits.min_altitude.value;
  context.leg.seed = seed;
  const ReplanPolicy& replan = mission.replan;
  if (replan.period_s) context.leg.replan.period_s = replan.period_s->value;
  if (replan.deviation_m) context.leg.replan.deviation_m = replan.deviation_m->value;
  context.leg.replan.max_replans = static_cast<int>(replan.max_replans.value);
  return context;
}

double ground_height(const planning::Scene& scene, const Position& position) {
  const Eigen::Vector3d at_surface(position.x.value, position.y.value, 0.0);
  return planning::ground_below(scene, at_surface).value_or(0.0);
}

behaviors::LegGoal leg_goal(const LeafContext& context, const Goal& goal) {
  behaviors::LegGoal leg;
  leg.id = goal.id.value;
  leg.position_W = goal.position.in_world(ground_height(*context.scene, goal.position));
  if (goal.heading_deg) leg.yaw = heading_to_yaw(goal.heading_deg->value);
  leg.capture_radius = goal.capture_radius.value;
  leg.dwell_s = goal.dwell_s.value;
  return leg;
}

std::unique_ptr<behaviors::Behavior> make_leaf_behavior(const LeafContext& context,
                                                        const StateSpec& spec) {
  if (const auto* leaf = std::get_if<GotoState>(&spec.leaf)) {
    return std::make_unique<behaviors::GoalSequence>(
        context.leg, std::vector<behaviors::LegGoal>{leg_goal(context, leaf->goal)});
  }
  if (const auto* leaf = std::get_if<GoalSequenceState>(&spec.leaf)) {
    std::vector<behaviors::LegGoal> goals;
    for (const Goal& goal : leaf->goals) goals.push_back(leg_goal(context, goal));
    return std::make_unique<behaviors::GoalSequence>(context.leg, std::move(goals));
  }
  if (const auto* leaf = std::get_if<HoldState>(&spec.leaf)) {
    return std::make_unique<behaviors::Hold>(leaf->duration_s.value);
  }
  DIVE_DEMAND(std::holds_alternative<SurfaceState>(spec.leaf));
  return std::make_unique<behaviors::Surface>();
}

std::array<behaviors::FailsafePolicy, behaviors::kFailsafeCount> failsafe_policies(
    const Failsafes& failsafes) {
  using behaviors::FailsafeKind;
  std::array<behaviors::FailsafePolicy, behaviors::kFailsafeCount> policies;
  const auto set = [&policies](FailsafeKind kind, const FailsafeSpec& spec) {
    auto& policy = policies[static_cast<std::size_t>(kind)];
    policy.rung = ladder_rung(spec.rung.value);
    policy.persistence_s = spec.persistence_s.value;
  };
  set(FailsafeKind::kLeak, failsafes.leak);
  set(FailsafeKind::kOvertime, failsafes.overtime);
  set(FailsafeKind::kOverdepth, failsafes.overdepth);
  set(FailsafeKind::kPlannerFailure, failsafes.planner_failure);
  policies[static_cast<std::size_t>(FailsafeKind::kRetraceFailure)].rung =
      behaviors::Rung::kEmergencySurface;
  return policies;
}

}  // namespace dive::mission
