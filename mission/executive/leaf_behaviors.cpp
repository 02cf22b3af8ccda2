#include "mission/executive/leaf_behaviors.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "behaviors/goal_sequence.h"
#include "behaviors/hold.h"
#include "behaviors/surface.h"
#include "common/assert.h"
#include "mission/document/state_index.h"
#include "planning/world/sounding.h"

namespace dive::mission {
namespace {

// s between two replans: in unknown water there is something new all the time.
constexpr double kUnknownInterval = 0.5;
constexpr double kUnknownDeviation = 0.5;  // of D_min, without word of the mission, ...
constexpr double kUnknownWait = 5.0;       // ... and s without progress, after which it plans anew
constexpr double kUnknownClimb = 0.4;    // rad: the eyes look no higher than a little above the bow
constexpr double kUnknownGoal = 0.5;     // m that a goal may be moved by, when something is near it
constexpr double kUnknownRise = 0.3;     // m, under an overhead
constexpr double kUnknownWayOut = 90.0;  // s that a blocked way out is tried again and again
constexpr int kUnknownUnreachable = 45;  // failed plans: what is in the way may go away
constexpr double kOptimisticStale = 3.0;  // s
constexpr double kJudged = 1.5;           // m: clearances are judged as far as that ...
constexpr double kBeyond = 1.1;           // ... and beyond the largest that is asked for

behaviors::ReplanPolicy replan_policy(const Mission& mission, const ReplanPolicy& written) {
  behaviors::ReplanPolicy policy;
  const auto take = [](const std::optional<Located<double>>& from, std::optional<double>& to) {
    if (from) to = from->value;
  };
  take(written.period_s, policy.period_s);
  take(written.deviation_m, policy.deviation_m);
  take(written.clearance_m, policy.clearance_m);
  take(written.no_progress_s, policy.no_progress_s);
  policy.map_change = written.map_change;
  policy.estimator_switch = written.estimator_switch;
  policy.max_replans = replans_per_leg(mission, written);
  if (!mission.unknown) return policy;
  policy.min_interval_s = kUnknownInterval;
  // Off its path the vehicle is where nothing was certified, and what it waits for may never come.
  if (!policy.deviation_m) policy.deviation_m = kUnknownDeviation * mission.limits.clearance.value;
  if (!policy.no_progress_s) policy.no_progress_s = kUnknownWait;
  return policy;
}

}  // namespace

LeafContext make_leaf_context(const Mission& mission, const planning::Scene& scene,
                              std::uint64_t seed) {
  LeafContext context;
  context.mission = &mission;
  context.scene = &scene;
  context.leg.speed = mission.speed.value;
  context.leg.clearance = mission.limits.clearance.value;
  context.leg.attitude = mission.attitude;
  context.leg.min_z = -mission.limits.max_depth.value;
  context.leg.min_altitude = mission.limits.min_altitude.value;
  context.leg.seed = seed;
  if (mission.unknown) {
    context.leg.backs_off = true;
    context.leg.goal_tolerance = kUnknownGoal;
    context.leg.way_out_wait_s = kUnknownWayOut;
    context.leg.unreachable_after = kUnknownUnreachable;
  }
  context.leg.replan = replan_policy(mission, mission.replan);
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

behaviors::LegSettings leg_settings(const LeafContext& context, const StateSpec& spec) {
  behaviors::LegSettings settings = context.leg;
  if (spec.replan) settings.replan = replan_policy(*context.mission, *spec.replan);
  if (context.mission->unknown && spec.overhead) settings.max_rise = kUnknownRise;
  return settings;
}

std::unique_ptr<behaviors::Behavior> make_surface(const LeafContext& context) {
  behaviors::SurfaceOptions options;
  if (context.leg.backs_off) options.room = context.leg.clearance;
  return std::make_unique<behaviors::Surface>(options);
}

std::unique_ptr<behaviors::Behavior> make_leaf_behavior(const LeafContext& context,
                                                        const StateSpec& spec, int goals_done) {
  if (const auto* leaf = std::get_if<GotoState>(&spec.leaf)) {
    return std::make_unique<behaviors::GoalSequence>(
        leg_settings(context, spec),
        std::vector<behaviors::LegGoal>{leg_goal(context, leaf->goal)});
  }
  if (const auto* leaf = std::get_if<GoalSequenceState>(&spec.leaf)) {
    std::vector<behaviors::LegGoal> goals;
    for (const Goal& goal : leaf->goals) goals.push_back(leg_goal(context, goal));
    return std::make_unique<behaviors::GoalSequence>(
        leg_settings(context, spec), std::move(goals),
        std::min(static_cast<std::size_t>(goals_done), leaf->goals.size() - 1));
  }
  if (const auto* leaf = std::get_if<HoldState>(&spec.leaf)) {
    return std::make_unique<behaviors::Hold>(leaf->duration_s.value);
  }
  DIVE_DEMAND(std::holds_alternative<SurfaceState>(spec.leaf));
  return make_surface(context);
}

behaviors::SeenAheadOptions seen_ahead_options(const Mission& mission) {
  behaviors::SeenAheadOptions options;
  if (mission.unknown != UnknownPolicy::kOptimistic) return options;
  options.stops_within_sight = false;
  options.stale_s = kOptimisticStale;
  return options;
}

double judged_clearance(const Mission& mission) {
  const StateIndex index(mission);
  double most = mission.limits.clearance.value;
  const auto look = [&most](const ReplanPolicy& policy) {
    if (policy.clearance_m) most = std::max(most, policy.clearance_m->value);
  };
  look(mission.replan);
  for (int state = 0; state < index.size(); ++state) {
    if (const auto& replan = index.spec(state).replan) look(*replan);
  }
  return std::max(kJudged, kBeyond * most);
}

planning::World known_world(const Mission& mission, planning::World world) {
  return mission.unknown ? planning::World{} : std::move(world);
}

planning::PlannerOptions planner_options(const Mission& mission, planning::PlannerOptions options) {
  if (mission.unknown) {
    double& climb = options.trajopt.motion.max_climb_rad;
    climb = std::min(climb, kUnknownClimb);
  }
  return options;
}

planning::MapperOptions mapper_options(const Mission& mission, planning::MapperOptions options) {
  options.memory_s = mission.memory_s;
  return options;
}

behaviors::MonitorLimits monitor_limits(const Mission& mission) {
  behaviors::MonitorLimits limits;
  limits.threshold = mission.failsafes.threshold;
  limits.max_depth = mission.limits.max_depth.value;
  limits.min_altitude = mission.limits.min_altitude.value;
  limits.mission_timeout_s = mission.limits.mission_timeout.value;
  limits.watches_range = mission.unknown.has_value();
  for (const auto& [x, y] : mission.failsafes.fence) limits.fence.emplace_back(x.value, y.value);
  return limits;
}

}  // namespace dive::mission
