#include "mission/executive/situation.h"

#include <limits>

namespace dive::mission {

GuardVariables guard_variables(const Situation& situation) {
  GuardVariables variables;
  variables.depth = -situation.estimate.X_WB.p.z();
  variables.altitude = situation.altitude_m.value_or(std::numeric_limits<double>::infinity());
  variables.battery_fraction = situation.health.battery_fraction;
  variables.temperature = situation.health.temperature_c;
  variables.elapsed = situation.elapsed_s;
  variables.state_elapsed = situation.state_elapsed_s;
  variables.distance_to_goal = situation.progress.distance_to_go_m;
  variables.clearance = situation.progress.clearance_m;
  variables.cross_track = situation.progress.cross_track_m;
  variables.position_sigma = estimation::horizontal_sigma(situation.estimate);
  variables.overhead = situation.overhead;
  variables.penetration = situation.penetration_m;
  variables.budget_used = situation.budget_used;
  variables.estimator = situation.estimate.source == estimation::EstimatorKind::kPrimitive
                            ? EstimatorName::kPrimitive
                            : EstimatorName::kVisualInertial;
  return variables;
}

behaviors::MonitorInput monitor_input(const Situation& situation) {
  const estimation::StateEstimate& estimate = situation.estimate;
  const vehicle::Command& command = situation.last_command;
  behaviors::MonitorInput input;
  input.now = situation.now;
  input.elapsed_s = situation.elapsed_s;
  input.estimate = &estimate;
  input.altitude_m = situation.altitude_m;
  input.margin_sigma = situation.margin.margin_sigma;
  input.command = command;
  input.expected_climb =
      (estimate.X_WB.q * Eigen::Vector3d(command.v, 0.0, situation.expected_heave)).z();
  input.leg_elapsed_s = situation.progress.elapsed_s;
  input.leg_expected_s = situation.progress.expected_s;
  input.plan_failures = situation.progress.plan_failures;
  input.out_of_replans = situation.out_of_replans;
  input.operator_abort = !situation.operator_abort.empty();
  input.retrace_failed = situation.retrace_failed;
  input.rises = situation.ascends;
  return input;
}

behaviors::BehaviorInput behavior_input(const Situation& situation) {
  behaviors::BehaviorInput input;
  input.now = situation.mission_now;
  input.estimate = &situation.estimate;
  input.current_W = situation.current_W;
  input.depth_known = situation.sensors.depth_is_fresh;
  input.attitude_known = situation.sensors.imu_is_fresh;
  input.can_go_up = situation.can_ascend;
  input.position_corrected = situation.position_corrected;
  input.trail_moved = situation.trail_moved;
  input.map_opened = situation.map_opened;
  input.obstacle_ahead = situation.obstacle_ahead;
  return input;
}

}  // namespace dive::mission
