#include "mission/executive/behavior_factory.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "mission/document/state_index.h"
#include "planning/map_matching/expected_view.h"

namespace dive::mission {
namespace {

// s between two replans: in an unknown environment the map changes all the time.
constexpr double kUnknownInterval = 0.5;
constexpr double kUnknownDeviation = 0.5;  // fraction of D_min, if the mission gives no value
constexpr double kUnknownWait = 5.0;       // s without progress, after which it replans
constexpr double kUnknownClimb = 0.4;      // rad: the sensor's view ends a little above the bow
// m by which a goal may be moved when an obstacle is near it
constexpr double kUnknownGoal = 0.5;
constexpr double kUnknownRise = 0.3;      // m, under an overhead
constexpr double kUnknownWayOut = 90.0;   // s for which a blocked exit path is retried
constexpr int kUnknownUnreachable = 45;   // failed plans: the obstacle may go away
constexpr double kOptimisticStale = 3.0;  // s
constexpr double kJudged = 1.5;           // m: minimum range in which clearances are evaluated
constexpr double kClearanceFactor = 1.1;  // of the largest required clearance
constexpr double kBesideMap = 5.0;        // m: beyond, a point may belong to the known map

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
  // Off its path the vehicle has no certified clearance, and the event it waits for may never
  // occur.
  if (!policy.deviation_m) policy.deviation_m = kUnknownDeviation * mission.limits.clearance.value;
  if (!policy.no_progress_s) policy.no_progress_s = kUnknownWait;
  return policy;
}

// Under way, a vehicle that has drifted too near to an obstacle may leave at any clearance.
planning::MotionLimits motion_limits(const Mission& mission) {
  planning::MotionLimits limits;
  limits.attitude = mission.attitude;
  limits.clearance = mission.limits.clearance.value;
  limits.reduced_clearance = 0.0;
  limits.min_z = -mission.limits.max_depth.value;
  limits.min_altitude = mission.limits.min_altitude.value;
  if (mission.unknown) limits.goal_tolerance = kUnknownGoal;
  return limits;
}

}  // namespace

BehaviorContext make_behavior_context(const Mission& mission, const planning::Scene& scene,
                                      std::uint64_t seed) {
  BehaviorContext context;
  context.mission = &mission;
  context.scene = &scene;
  context.leg.speed = mission.speed.value;
  context.leg.limits = motion_limits(mission);
  if (const auto& change = mission.limits.max_depth_change) {
    context.leg.max_rise = change->value;
    context.leg.max_drop = change->value;
  }
  context.leg.seed = seed;
  if (mission.unknown) {
    context.leg.recovery.by_motion = true;
    context.leg.recovery.back_off.kept_clearance = 0.0;
    context.leg.recovery.blocked_trail.wait_s = kUnknownWayOut;
    context.leg.recovery.unreachable_after = kUnknownUnreachable;
  }
  context.leg.replan = replan_policy(mission, mission.replan);
  return context;
}

behaviors::LegSettings leg_settings(const BehaviorContext& context, const StateSpec& spec) {
  behaviors::LegSettings settings = context.leg;
  if (spec.replan) settings.replan = replan_policy(*context.mission, *spec.replan);
  if (context.mission->unknown && spec.overhead) {
    settings.max_rise = std::min(settings.max_rise.value_or(kUnknownRise), kUnknownRise);
  }
  return settings;
}

behaviors::StoppingSpeedOptions stopping_speed_options(const Mission& mission) {
  behaviors::StoppingSpeedOptions options;
  if (mission.unknown != UnknownPolicy::kOptimistic) return options;
  options.requires_observed_space = false;
  options.stale_s = kOptimisticStale;
  return options;
}

double evaluated_clearance(const Mission& mission) {
  const StateIndex index(mission);
  double most = mission.limits.clearance.value;
  const auto look = [&most](const ReplanPolicy& policy) {
    if (policy.clearance_m) most = std::max(most, policy.clearance_m->value);
  };
  look(mission.replan);
  for (int state = 0; state < index.size(); ++state) {
    if (const auto& replan = index.spec(state).replan) look(*replan);
  }
  return std::max(kJudged, kClearanceFactor * most);
}

planning::World known_world(const Mission& mission, planning::World world) {
  return mission.unknown ? planning::World{} : std::move(world);
}

planning::PlannerOptions planner_options(const Mission& mission, const planning::World& known,
                                         planning::PlannerOptions options) {
  if (mission.prefers_information) {
    options.preferred_view = std::make_shared<planning::ExpectedView>(known);
  }
  if (mission.unknown) {
    double& climb = options.trajopt.kinematics.max_climb_rad;
    climb = std::min(climb, kUnknownClimb);
  }
  return options;
}

planning::MapperOptions mapper_options(const Mission& mission, planning::MapperOptions options) {
  options.memory_s = mission.memory_s;
  if (mission.unknown) return options;
  options.max_range_m = kBesideMap;
  // Farther away too: a false obstacle costs more where a map says that the water is free.
  options.snow_range_m = kBesideMap;
  return options;
}

behaviors::MonitorLimits monitor_limits(const Mission& mission) {
  behaviors::MonitorLimits limits;
  limits.threshold = mission.failsafes.threshold;
  limits.max_depth = mission.limits.max_depth.value;
  limits.min_altitude = mission.limits.min_altitude.value;
  limits.mission_timeout_s = mission.limits.mission_timeout.value;
  limits.watches_range = mission.unknown.has_value() || uses_map_fixes(mission);
  for (const auto& [x, y] : mission.failsafes.fence) limits.fence.emplace_back(x.value, y.value);
  return limits;
}

}  // namespace dive::mission
