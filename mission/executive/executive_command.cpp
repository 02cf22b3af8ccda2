// The stages of a tick that command the vehicle: steer, actuate.

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "behaviors/view_speed_limit.h"
#include "mission/executive/executive_impl.h"
#include "mission/states/atomic_state.h"
#include "vehicle/going_home.h"

namespace dive::mission {
namespace {

using behaviors::Rung;
using statechart::StateId;

}  // namespace

void Executive::Impl::steer() {
  brakes = mission.unknown.has_value();
  if (!is_held()) {
    held.reset();
    follow_behavior();
  } else {
    if (!held) held = keep_station();  // plans that arrive meanwhile are kept
    command = *held;
  }
  stop_for_obstacle();
  hold_speed();
}

// Where the velocity over ground is measured: fixes contain the current, which pushes a slow
// vehicle off its path and towards what it has stopped for.
void Executive::Impl::hold_speed() {
  if (!situation.sensors.imu_is_fresh || !measures_its_speed()) return;
  const estimation::StateEstimate& now = situation.estimate;
  if (brakes) {
    behaviors::compensate_drift(now.v_WB_B.x(), to_rpy(now.X_WB.q).z(), command);
  } else if (uses_map_fixes(mission) && !situation.ascends) {
    behaviors::hold_speed(now.v_WB_B.x(), command);
  }
}

// Prevents all motion ahead, but neither an ascent nor a way back. The behaviour receives
// the obstacle as well.
void Executive::Impl::stop_for_obstacle() {
  if (situation.now >= stop_until || command.v <= 0.0) {
    stopped.reset();
    return;
  }
  if (situation.ascends) {
    command.v = 0.0;
    return;
  }
  if (!stopped) stopped = keep_station();
  command = *stopped;
  brakes = true;
}

vehicle::Command Executive::Impl::keep_station() const {
  const Pose& X_WB = situation.estimate.X_WB;
  return behaviors::station_keeping(std::max(-X_WB.p.z(), 0.0), to_rpy(X_WB.q).z());
}

// True if the map, or vision in use, provides the velocity: an outdated velocity must not close the
// speed loop.
bool Executive::Impl::measures_its_speed() const {
  if (situation.estimate.source == estimation::EstimatorKind::kVisualInertial) return true;
  const bool lacks_scans =
      uses_map_fixes(mission) && monitors.is_true(behaviors::FailsafeKind::kRangeLost);
  return !uses_visual_inertial(mission) && !lacks_scans;
}

void Executive::Impl::follow_behavior() {
  const std::optional<StateId> state = behavior.state();
  if (!state) {  // the machine has ended
    command = keep_station();
    if (situation.open_above) {
      command.d = situation.sensors.depth_is_fresh ? 0.0 : vehicle::kAboveSurface;
    }
    return;
  }
  const bool replan = ladder.rung() == Rung::kReplan;
  const behaviors::BehaviorOutput result = behavior.step(situation, replan, outputs.plan_query);
  command = result.command;
  brakes |= result.brakes;
  if (result.done) {
    const std::string& id = machine.chart.states[static_cast<std::size_t>(*state)].id;
    runner.dispatch({"done.state." + id, id + " is done"});
  }
  if (result.failed != behaviors::Failure::kNone) fail(*state, result.failed);
}

void Executive::Impl::fail(StateId state, behaviors::Failure failure) {
  const auto index = static_cast<std::size_t>(state);
  const std::string& why = behavior.progress().plan_failure;
  if (machine.is_own(state) || is_retracing(*machine.specs[index])) {
    situation.retrace_failed = true;  // the failsafe responds in the next tick
    situation.retrace_failure = why.empty() ? "the trail never had open water above" : why;
    return;
  }
  const std::string& id = machine.chart.states[index].id;
  const bool is_exhausted = failure == behaviors::Failure::kExhausted;
  if (is_exhausted) situation.out_of_replans = true;
  runner.dispatch({"plan.failed." + id, fmt::format("no plan for {}: {}", id,
                                                    is_exhausted ? "no replans are left" : why)});
}

void Executive::Impl::actuate() {
  outputs.command = command;
  double dt = to_seconds(situation.now - last_step);
  if (started && has_gap()) {
    control.begin_at(localization.surge());
    dt = to_seconds(vehicle::kCommandStale);
  }
  const SensorStatus& sensors = situation.sensors;
  const estimation::StateEstimate& now = situation.estimate;
  if (started && dt > 0.0 && sensing.imu() != nullptr && sensing.has_depth()) {
    const double depth = sensors.depth_is_fresh ? sensors.depth_m : -now.X_WB.p.z();
    control.step(command,
                 {sensing.imu(), sensors.imu_is_fresh, depth, sensors.depth_is_fresh, now.v_WB_B,
                  localization.surge(), now.map_from_odom.yaw},
                 dt);
  }
  last_step = situation.now;
  outputs.rates = control.rates();
}

}  // namespace dive::mission
