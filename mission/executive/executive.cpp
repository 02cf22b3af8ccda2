#include "mission/executive/executive.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "behaviors/view_speed_limit.h"
#include "common/assert.h"
#include "mission/executive/behavior_factory.h"
#include "mission/executive/executive_impl.h"
#include "mission/executive/failsafe_words.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {
namespace {

using behaviors::Rung;
using statechart::StateId;

constexpr double kPushUp = -1.0;  // m of depth: above the surface, so that effort stays upwards

/// The event for the transition to the executive's own state of a rung; null if the rung has none.
const char* takeover_event(Rung rung) {
  switch (rung) {
    case Rung::kRetrace:
      return kRetraceEvent;
    case Rung::kAbortAndSurface:
      return kAbortEvent;
    case Rung::kEmergencySurface:
      return kEmergencyEvent;
    default:
      return nullptr;
  }
}

FailsafeRecord record_of(const behaviors::FailsafeLadder::Change& change, const Mission& mission,
                         const Situation& situation) {
  FailsafeRecord record{
      behaviors::to_string(change.rung),
      std::string(behaviors::to_string(change.cause)),
      {},
      change.rung == Rung::kNone ? "it is gone" : describe(change.cause, mission, situation)};
  if (change.escalated) record.why += ", and it did not pass";
  for (const behaviors::FailsafeKind kind : change.competing) {
    if (!record.competing.empty()) record.competing += ", ";
    record.competing += behaviors::to_string(kind);
  }
  return record;
}

}  // namespace

const char* to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::kRunning:
      return "running";
    case Outcome::kSuccess:
      return "success";
    case Outcome::kAborted:
      return "aborted";
  }
  return "running";
}

Executive::Impl::Impl(const Mission& mission_in, const planning::World& world,
                      const vehicle::Model& model, ExecutiveOptions options_in)
    : mission(mission_in),
      options(std::move(options_in)),
      map(world, model.hull, evaluated_clearance(mission_in)),
      missing_objects(world, mission_in.trusts_absence),
      machine(build_machine(mission_in)),
      runner(machine, *this, outputs),
      overhead_monitor(mission_in, map),
      behavior(mission_in, machine, map, overhead_monitor.trail(), options.seed),
      localization(mission_in, model.motion, first_position(), first_sigma()),
      control(vehicle::autopilot_options(model.motion)),
      exit_path({.link_m = behaviors::kTrailLinkShare * mission_in.limits.clearance.value,
                 .speed = mission_in.speed.value,
                 .current_sigma = mission_in.priors.current},
                map),
      fallback(model.motion),
      monitors(monitor_limits(mission_in)),
      ladder(mission_in.failsafes.policies) {}

void Executive::Impl::step(const StepInputs& inputs) {
  begin_tick(inputs.now);
  sense(inputs);
  estimate(inputs);
  if (situation.estimate.valid) {
    if (!started) start();
    assess();
    collect_events(inputs);
    evaluate_failsafes();
    process_events();
    steer();
  }
  actuate();
  fill_status();
  keep_exit_path();
}

void Executive::Impl::begin_tick(Utime now) {
  outputs.plan_query.reset();
  outputs.transitions.clear();
  outputs.failsafes.clear();
  outputs.actions.clear();
  events.clear();
  DIVE_DEMAND(!started || now >= situation.now);
  if (started && is_held()) held_for += now - situation.now;
  situation.now = now;
  situation.mission_now = now - held_for;
  situation.last_command = command;
  situation.obstacle_ahead = false;
  runner.set_time(situation.mission_now);
}

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
  static_cast<void>(localization.update(last_step + kCommandLifetime));
  if (situation.now - last_step > kHeldBySupervisor) given_back_at = situation.now + kGiveBack;
  note(fmt::format("no tick for {:.1f} s: the vehicle stopped meanwhile",
                   to_seconds(situation.now - last_step)));
}

void Executive::Impl::start() {
  started = true;
  started_at = last_step = situation.now;
  monitors.start(situation.now);
  if (options.resume) return resume(*options.resume);
  assess();
  runner.start();
}

// Updates overhead, altitude, and the resources used.
void Executive::Impl::assess() {
  const double battery = situation.health.battery_fraction;
  overhead_monitor.update(situation.now, situation.estimate, behavior.declared_overhead(), battery);
  situation.overhead = overhead_monitor.has_overhead();
  situation.open_above = overhead_monitor.open_above();
  // A vehicle without attitude cannot steer, so ascending is its best option wherever nothing is
  // above it.
  situation.can_ascend =
      situation.open_above || (!situation.overhead && !situation.sensors.imu_is_fresh);
  situation.altitude_m = overhead_monitor.altitude_m();
  situation.penetration_m = overhead_monitor.trail().penetration_m();
  situation.budget_used = overhead_monitor.budget_used(situation.now, started_at, battery);
  situation.elapsed_s = to_seconds(situation.now - started_at);
  situation.state_elapsed_s = runner.state_elapsed_s();
  situation.progress = behavior.progress();
  situation.ascends = behavior.state() && behavior.behavior().rises();
  runner.set_variables(guard_variables(situation));
}

// Processing order: events of the operator, of the estimator, of the map, and then of the
// failsafes.
void Executive::Impl::collect_events(const StepInputs& inputs) {
  if (inputs.operator_command) obey(*inputs.operator_command);
  if (localization.has_switched()) {
    const std::string cause = localization.describe_switch();
    note("estimator " + cause);
    raise_event("estimator.switched", cause);
  }
  if (inputs.vision) {
    if (auto cause = localization.describe_loop(situation.now, inputs.vision->loops)) {
      note("loop closed: " + *cause);
      raise_event("loop.closed", std::move(*cause));
    }
  }
  for (std::string& change : object_changes) raise_event("map.changed", std::move(change));
  const bool was_blocked = std::exchange(path_was_blocked, situation.progress.path_is_blocked);
  if (path_was_blocked && !was_blocked) {
    raise_event("map.changed", "an observed obstacle is in the path");
  }
}

void Executive::Impl::obey(OperatorCommand operator_command) {
  monitors.heartbeat(situation.now);  // every command is a heartbeat of topside
  switch (operator_command) {
    case OperatorCommand::kHeartbeat:
      return;
    case OperatorCommand::kAbort:
      return abort("topside says abort");
    case OperatorCommand::kSigterm:
    case OperatorCommand::kSigint:
      situation.is_terminated = true;
      return abort(fmt::format("{} to the executive", to_string(operator_command)));
    case OperatorCommand::kPause:
      if (!std::exchange(paused, true)) raise_event("operator.pause", "topside says pause");
      return;
    case OperatorCommand::kResume:
      if (std::exchange(paused, false)) raise_event("operator.resume", "topside says resume");
      return;
    case OperatorCommand::kSkip:
      skip_requested = true;
      return;
  }
}

void Executive::Impl::abort(std::string cause) {
  situation.operator_abort = cause;
  raise_event("abort", std::move(cause));
}

void Executive::Impl::evaluate_failsafes() {
  const bool was_losing = monitors.is_true(behaviors::FailsafeKind::kLogLost);
  const behaviors::FailsafeConditions& conditions = monitors.update(monitor_input(situation));
  situation.map_agreement = monitors.map_agreement();
  // The records of its beginning are among what was lost.
  if (was_losing && !monitors.is_true(behaviors::FailsafeKind::kLogLost)) {
    note(describe(behaviors::FailsafeKind::kLogLost, mission, situation));
  }
  const auto change = ladder.update(situation.now, conditions, situation.can_ascend);
  if (change) take_rung(*change);
}

void Executive::Impl::take_rung(const behaviors::FailsafeLadder::Change& change) {
  const FailsafeRecord record = record_of(change, mission, situation);
  outputs.failsafes.push_back(record);
  held.reset();
  if (!runner.is_running() || change.rung == Rung::kNone) return;
  const std::string cause = fmt::format("failsafe {}: {}", record.cause, record.why);
  raise_event("failsafe." + record.cause, cause);
  const char* takeover = takeover_event(change.rung);
  if (takeover == nullptr) return;
  runner.set_abort_cause(cause);
  paused = false;  // a pause never prevents surfacing
  raise_event(takeover, cause);
}

// The only place where events of a tick are dispatched to the machine, except those of the
// behaviour's end.
void Executive::Impl::process_events() {
  if (std::exchange(skip_requested, false)) skip();
  for (const Event& event : events) {
    if (runner.is_running()) runner.dispatch(event);
  }
  if (const std::optional<Event> timeout = runner.next_timeout()) {
    if (runner.abort_cause().empty()) runner.set_abort_cause(timeout->cause);
    // others are reported in the next tick, because the states have changed
    runner.dispatch(*timeout);
  }
  if (runner.is_running()) runner.settle();
}

// The mission may handle a skip itself; otherwise the goal is skipped, or the state if it has no
// goals.
void Executive::Impl::skip() {
  const char* cause = "topside says skip";
  if (!behavior.is_missions()) {
    return note("topside says skip, but the mission is not in command");
  }
  const StateId state = *behavior.state();
  const std::string& id = machine.chart.states[static_cast<std::size_t>(state)].id;
  if (runner.is_running()) runner.dispatch({"operator.skip", cause});
  if (behavior.state() != state || behavior.behavior().skip()) return;
  runner.dispatch({"done.state." + id, cause});
}

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
  if (brakes && situation.sensors.imu_is_fresh && measures_its_speed()) {
    const estimation::StateEstimate& now = situation.estimate;
    behaviors::compensate_drift(now.v_WB_B.x(), to_rpy(now.X_WB.q).z(), command);
  }
}

// Prevents all motion ahead, but neither an ascent nor a way back. The behaviour has been told of
// the obstacle as well.
void Executive::Impl::stop_for_obstacle() {
  if (situation.now >= stop_until || command.v <= 0.0) {
    stopped.reset();
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
  return !uses_visual_inertial(mission) ||
         situation.estimate.source == estimation::EstimatorKind::kVisualInertial;
}

void Executive::Impl::follow_behavior() {
  const std::optional<StateId> state = behavior.state();
  if (!state) {  // the machine has ended
    command = keep_station();
    if (situation.open_above) {
      command.d = situation.sensors.depth_is_fresh ? 0.0 : kPushUp;
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
    dt = to_seconds(kCommandLifetime);
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

void Executive::Impl::fill_status() {
  const behaviors::Progress& progress = behavior.progress();
  Status& status = outputs.status;
  status.state = runner.innermost();
  status.goal = progress.goal;
  status.distance_to_go_m = progress.distance_to_go_m;
  status.time_to_go_s = progress.distance_to_go_m / mission.speed.value;
  status.depth_m = -situation.estimate.X_WB.p.z();
  status.clearance_m = progress.clearance_m;
  status.cross_track_m = progress.cross_track_m;
  status.segment = progress.segment;
  status.rung = behaviors::to_string(ladder.rung());
  status.finished = started && !runner.is_running();
}

void Executive::Impl::keep_exit_path() {
  if (!situation.estimate.valid) return;
  exit_path.update(situation, localization.v_B(), localization.unmodelled(), ladder.rung());
  fallback.keep(exit_path.path());
}

ExecutiveResult Executive::Impl::result() const {
  ExecutiveResult result;
  result.cause = runner.abort_cause();
  if (!situation.internal_error.empty()) {
    result.outcome = fallback.is_done() ? Outcome::kAborted : Outcome::kRunning;
    result.final_state = kFallbackState;
    return result;
  }
  result.final_state = runner.innermost();
  if (!started || runner.is_running()) return result;
  result.outcome = runner.has_aborted() ? Outcome::kAborted : Outcome::kSuccess;
  return result;
}

Executive::Executive(const Mission& mission, const planning::World& world,
                     const vehicle::Model& model, ExecutiveOptions options)
    : impl_(std::make_unique<Impl>(mission, world, model, std::move(options))) {}
Executive::Executive(Executive&&) noexcept = default;
Executive& Executive::operator=(Executive&&) noexcept = default;
Executive::~Executive() = default;

const StepOutputs& Executive::step(const StepInputs& inputs) {
  Impl& impl = *impl_;
  std::string& internal_error = impl.situation.internal_error;
  if (internal_error.empty()) {
    try {
      impl.step(inputs);
      return impl.outputs;
    } catch (const std::exception& error) {
      internal_error = error.what();
      impl.runner.set_abort_cause(fmt::format("failsafe internal_error: {}", error.what()));
    }
  }
  return impl.outputs = impl.fallback.step(inputs, impl.runner.abort_cause());
}

Checkpoint Executive::checkpoint() const { return impl_->checkpoint(); }
const vehicle::ExitPath& Executive::exit_path() const { return impl_->exit_path.path(); }
std::vector<Pose> Executive::way_ahead(double seconds) const {
  if (!impl_->situation.estimate.valid || !impl_->behavior.state()) return {};
  return impl_->behavior.behavior().way_ahead(impl_->situation.estimate.X_WB, seconds);
}
const behaviors::Trail& Executive::trail() const { return impl_->overhead_monitor.trail(); }
ExecutiveResult Executive::result() const { return impl_->result(); }

}  // namespace dive::mission
