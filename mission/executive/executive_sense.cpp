// The stages of a tick that find out what is known: sense, estimate, assess.

#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "mission/executive/executive_impl.h"

namespace dive::mission {

// Passes samples to the odometry, and scans, plans and vision estimates to their users. Position
// corrections are proposed before the position is estimated.
void Executive::Impl::sense(const StepInputs& inputs) {
  sensing.update(inputs, monitors, localization);
  situation.sensors = sensing.status();
  situation.health = monitors.health();
  if (inputs.vision) {
    localization.add(inputs.now, *inputs.vision);
    if (auto about = localization.describe_tag(inputs.vision->tag)) note(std::move(*about));
  }
  if (map.update(inputs.observed_map)) behavior.take_map_change();
  take_object_changes(inputs);
  if (inputs.plan) behavior.take(*inputs.plan);
  take_scan(inputs);
  if (inputs.loss) take_loss(inputs.now, *inputs.loss);
}

// Those that the map has accepted.
void Executive::Impl::take_object_changes(const StepInputs& inputs) {
  object_changes.clear();
  situation.map_opened = false;
  for (const planning::ObstacleUpdate& update : inputs.obstacles) {
    for (const planning::ObjectChange& change : update.objects) {
      if (inputs.observed_map.absent().contains(change.first) != change.is_absent) continue;
      std::optional<std::string> text = missing_objects.describe(change);
      if (!text) continue;
      situation.map_opened |= change.is_absent;
      note(*text);
      object_changes.push_back(*std::move(text));
    }
  }
}

void Executive::Impl::take_loss(Utime now, const RecordingLoss& loss) {
  monitors.lose_log(now);
  if (loss.commands > situation.loss.commands) {
    note(fmt::format("{} payload commands were not sent, because the journal did not get them",
                     loss.commands));
  }
  situation.loss = loss;
}

void Executive::Impl::take_scan(const StepInputs& inputs) {
  if (const auto& free_ahead = inputs.free_ahead;
      free_ahead && sensing.accept(inputs.now, *free_ahead)) {
    monitors.receive_scan(free_ahead->scan_utime);
    behavior.take_free_ahead(free_ahead->scan_utime, free_ahead->free_ahead_m);
  }
  if (const auto& obstacle = inputs.obstacle_ahead;
      obstacle && sensing.accept(inputs.now, *obstacle)) {
    take_obstacle(*obstacle);
  }
  situation.trail_moved = false;
  if (const auto& correction = inputs.map_correction;
      correction && Sensing::accept(inputs.now, *correction)) {
    move_map(*correction);
  }
  if (const auto& correction = inputs.pose_correction;
      correction && sensing.accept(inputs.now, *correction)) {
    localization.propose_alignment(correction->correction_W);
  }
  if (const auto& fix = inputs.map_fix; fix && sensing.accept(inputs.now, *fix)) {
    monitors.receive(*fix);
    if (auto text = missing_objects.observe(fix->agreement.missing_object)) note(std::move(*text));
    if (auto text = localization.propose(*fix, situation.sensors.depth_is_fresh))
      note(std::move(*text));
  }
}

// The obstacles have moved in the same tick.
void Executive::Impl::move_map(const MapCorrection& correction) {
  if (mission.unknown && uses_visual_inertial(mission)) {
    localization.move(correction.newest());
    overhead_monitor.move(correction);
    exit_path.move(correction);
    situation.trail_moved = true;
  }
}

void Executive::Impl::take_obstacle(const planning::ObstacleAhead& obstacle) {
  situation.obstacle_ahead = true;
  if (situation.now >= stop_until) {
    note(fmt::format("stops: by the last scan the hull reaches an obstacle in {:.1f} s",
                     obstacle.time_s));
  }
  stop_until = situation.now + kProximityStop;
}

void Executive::Impl::estimate(const StepInputs& inputs) {
  const bool imu_is_fresh = situation.sensors.imu_is_fresh;
  if (started && !imu_is_fresh) localization.predict_attitude(inputs.now, control.predicted());
  const double speed = imu_is_fresh ? command.v : 0.0;  // as the control stage defines it
  situation.expected_heave = control.expected_heave(speed);
  situation.current_W = declared_current(inputs.now);
  localization.expect_current(situation.current_W);
  if (has_gap()) {
    if (started) estimate_over_gap();
    localization.expect_stop(situation.expected_heave);
  } else {
    localization.expect(control.rates(), situation.expected_heave);
  }
  outputs.estimate = situation.estimate = localization.update(inputs.now);
  situation.position_corrected = localization.has_jumped();
  if (situation.estimate.valid) behavior.advance_view(inputs.now, situation.estimate.X_WB.p);
}

// Commands expire: a vehicle whose executive was stalled has stopped. It is held by the supervisor
// until that has received commands for a while; what is commanded meanwhile must not be expected.
void Executive::Impl::estimate_over_gap() {
  localization.expect(control.rates(), situation.expected_heave);
  static_cast<void>(localization.update(last_step + vehicle::kCommandStale));
  if (situation.now - last_step > vehicle::kHeldBySupervisor) {
    given_back_at = situation.now + vehicle::kGivenBack;
  }
  note(fmt::format("no tick for {:.1f} s: the vehicle stopped meanwhile",
                   to_seconds(situation.now - last_step)));
}

// Updates overhead, altitude, and the resources used.
void Executive::Impl::assess() {
  const double battery = situation.health.battery_fraction;
  overhead_monitor.update(situation.now, situation.estimate, behavior.declared_overhead(), battery);
  situation.overhead = overhead_monitor.has_overhead();
  situation.open_above = overhead_monitor.open_above();
  // A vehicle whose attitude does not come back cannot steer, so ascending is its best option
  // wherever nothing is above it.
  if (situation.sensors.imu_is_fresh) attitude_known_at = situation.now;
  const bool is_blind = situation.now - attitude_known_at > kAwaitAttitude;
  situation.can_ascend = situation.open_above || (!situation.overhead && is_blind);
  situation.altitude_m = overhead_monitor.altitude_m();
  situation.penetration_m = overhead_monitor.trail().penetration_m();
  situation.budget_used = overhead_monitor.budget_used(situation.now, started_at, battery);
  situation.elapsed_s = to_seconds(situation.now - started_at);
  situation.state_elapsed_s = runner.state_elapsed_s();
  situation.progress = behavior.progress();
  situation.ascends = behavior.state() && behavior.behavior().rises();
  assess_margin();
  runner.set_variables(guard_variables(situation));
}

// Observed obstacles do not count: they are known from where the vehicle observed them, and not by
// its position in the map.
void Executive::Impl::assess_margin() {
  if (mission.unknown || !margin_monitor.is_due(situation.now)) return;
  const Pose& X_WB = situation.estimate.X_WB;
  way.clear();
  if (behavior.state()) behavior.behavior().way_ahead(X_WB, MarginMonitor::kAhead, way);
  margin_monitor.update(situation.now, map.scene(), X_WB, way,
                        localization.covariance_among_obstacles());
  situation.margin = margin_monitor.least();
}

}  // namespace dive::mission
