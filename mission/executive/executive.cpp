#include "mission/executive/executive.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "behaviors/failsafes.h"
#include "behaviors/monitors.h"
#include "behaviors/sight_limit.h"
#include "common/assert.h"
#include "mission/executive/changed_map.h"
#include "mission/executive/failsafe_words.h"
#include "mission/executive/helm.h"
#include "mission/executive/leaf_behaviors.h"
#include "mission/executive/leaves.h"
#include "mission/executive/machine.h"
#include "mission/executive/navigator.h"
#include "mission/executive/surfacing_fallback.h"
#include "mission/executive/surroundings.h"
#include "mission/statechart/interpreter.h"

namespace dive::mission {
namespace {

using behaviors::FailsafeKind;
using statechart::StateId;

constexpr Utime kSilence = 500'000;   // us, of the depth sensor: then the estimate stands in
constexpr Utime kBlind = 100'000;     // us without attitude: then no turning effort is made
constexpr Utime kAhead = 100'000;     // us that a camera's clock may be before ours
constexpr double kLoopNews = 10.0;    // s after which a loop that is closed is news again, ...
constexpr double kLoopNews_m = 0.05;  // ... or when it moves the vehicle so far

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

struct Executive::Impl final : statechart::Environment {
  Impl(const Mission& mission_in, const planning::World& world, const vehicle::Model& model,
       ExecutiveOptions options_in)
      : mission(mission_in),
        options(std::move(options_in)),
        map(world, model.hull, judged_clearance(mission_in)),
        machine(build_machine(mission_in)),
        interpreter(machine.chart, *this),
        surroundings(mission_in, map),
        leaves(mission_in, machine, map, surroundings.trail(), options.seed),
        navigator(mission_in.estimator.value, options.estimator, first_position(), first_sigma()),
        helm(options.autopilot),
        fallback(options.autopilot),
        monitors(monitor_limits(mission_in)),
        sight(seen_ahead_options(mission_in)),
        ladder(mission_in.failsafes.policies),
        entered_at(machine.chart.states.size()),
        timeout_told(machine.chart.states.size()),
        done_once(machine.actions.size()) {
    evaluated.reserve(machine.guards.size());
  }

  [[nodiscard]] Eigen::Vector3d first_position() const {
    if (options.resume) return options.resume->committed.X_WB.p;
    return mission.start.in_world(ground_height(map.scene(), mission.start));
  }
  [[nodiscard]] double first_sigma() const {
    if (!options.resume) return options.start_sigma_m;
    return options.resume->committed.sigma_m;
  }

  // --- statechart::Environment ---

  bool evaluate(statechart::GuardId guard) override {
    const bool is_true = machine.guards[static_cast<std::size_t>(guard)].evaluate(variables);
    if (evaluated.size() < evaluated.capacity()) evaluated.emplace_back(guard, is_true);
    return is_true;
  }

  void execute(statechart::ActionId id) override {
    const auto index = static_cast<std::size_t>(id);
    const ActionSpec& action = machine.actions[index];
    switch (action.kind) {
      case ActionSpec::Kind::kLog:
        outputs.actions.push_back({ActionRecord::Kind::kLog, action.text.value});
        return;
      case ActionSpec::Kind::kRaise:
        interpreter.raise(action.text.value);
        return;
      case ActionSpec::Kind::kPayload:
        if (action.once && done_once[index]) return;
        done_once[index] = true;
        outputs.actions.push_back({ActionRecord::Kind::kPayload, action.text.value});
        return;
    }
  }

  void entered(StateId state) override {
    const auto index = static_cast<std::size_t>(state);
    const statechart::State& entered_state = machine.chart.states[index];
    entered_at[index] = leaf_now();
    timeout_told[index] = false;
    if (entered_state.kind == statechart::StateKind::kFinal) {
      if (entered_state.parent == 0) final_state = entered_state.id;
    } else if (entered_state.kind == statechart::StateKind::kAtomic) {
      leaves.enter(state);
      refuse_to_surface_under_a_roof(state);
    }
    if (outputs.transitions.empty()) {
      outputs.transitions.push_back({"", "", "", "the mission starts", ""});
    }
    outputs.transitions.back().to = entered_state.id;
  }
  void exited(StateId state) override {
    leaves.leave(state);
    sight.stop_waiting();
  }
  void taken(int /*transition*/, const std::string& event) override {
    const std::string here = innermost();
    outputs.transitions.push_back({here, here, event,
                                   event.empty() ? "its guard became true" : event_cause,
                                   describe_guards()});
    evaluated.clear();
  }

  // --- one step ---

  void step(const StepInputs& inputs) {
    outputs.plan_query.reset();
    outputs.transitions.clear();
    outputs.failsafes.clear();
    outputs.actions.clear();
    DIVE_DEMAND(!started || inputs.now >= now);
    const Utime before = started ? now : inputs.now;
    now = inputs.now;
    if (is_held()) held_for += now - before;
    sense(inputs);
    if (estimate().valid) sight.advance(now, position());
    if (!inputs.seen.empty()) {
      map.add(inputs.seen);
      leaves.map_changed();
    }
    if (inputs.map_update) look_at(*inputs.map_update);
    if (inputs.plan) leaves.take(*inputs.plan);
    if (estimate().valid) {
      if (!started) start();
      look_around();
      if (inputs.operator_command) obey(*inputs.operator_command);
      if (navigator.has_switched()) tell_switch();
      if (inputs.vision) tell_loop(inputs.vision->loops);
      if (!inputs.seen.empty()) tell("map.changed", "something was seen that the map did not know");
      climb_ladder();
      tell_timeouts();
      if (interpreter.running()) settle();
      run_leaf();
      if (mission.unknown && hears_imu() && sees_its_speed()) {
        behaviors::hold_speed(estimate().v_WB_B.x(), to_rpy(estimate().X_WB.q).z(), last_command);
      }
    }
    actuate();
    fill_status();
  }

  [[nodiscard]] const estimation::StateEstimate& estimate() const { return outputs.estimate; }
  [[nodiscard]] const Eigen::Vector3d& position() const { return estimate().X_WB.p; }
  /// The behaviours' clock: it stands still while the vehicle is held.
  [[nodiscard]] Utime leaf_now() const { return now - held_for; }
  [[nodiscard]] bool is_held() const { return paused || ladder.rung() == behaviors::Rung::kHold; }
  [[nodiscard]] bool hears_depth() const {
    return last_depth && now - depth_heard <= kSilence &&
           !monitors.is_true(FailsafeKind::kDepthLost);
  }
  [[nodiscard]] bool hears_imu() const {
    return now - imu_heard <= kBlind && !monitors.is_true(FailsafeKind::kImuLost);
  }

  // By the map, or by the cameras while they see; what is remembered of them is not to be held.
  [[nodiscard]] bool sees_its_speed() const {
    return !goes_by_sight(mission) ||
           estimate().source == estimation::EstimatorKind::kVisualInertial;
  }

  // A vehicle that cannot steer well does better to rise where it is, if only just.
  [[nodiscard]] bool can_go_up() const {
    return surroundings.open_above() ||
           (!surroundings.is_under() && !(hears_imu() && hears_depth()));
  }

  void sense(const StepInputs& inputs) {
    if (inputs.imu && monitors.accept(now, *inputs.imu)) {
      navigator.add(*inputs.imu);
      last_imu = *inputs.imu;
      imu_heard = now;
    }
    if (inputs.depth && monitors.accept(now, *inputs.depth)) {
      last_depth = *inputs.depth;
      depth_heard = now;
      // One that is lost may go on talking: the same, again and again.
      if (!monitors.is_true(FailsafeKind::kDepthLost)) navigator.add(*inputs.depth);
    }
    if (inputs.health) static_cast<void>(monitors.accept(now, *inputs.health));
    if (inputs.vision) {
      navigator.add(now, *inputs.vision);
      if (auto about = navigator.describe_tag(inputs.vision->tag)) note(std::move(*about));
    }
    expected_heave = helm.expected_heave(last_command.v);
    navigator.expect(last_command.v, expected_heave);
    outputs.estimate = navigator.update(now);
    last_estimate = outputs.estimate;
  }

  void look_at(const planning::MapUpdate& update) {
    if (update.scan_utime > now + kAhead || !map.apply(update)) return;
    monitors.saw(update.scan_utime);
    navigator.moved(update.off_W);
    sight.hear(update.scan_utime, update.seen_ahead_m);
    if (!update.cells.empty()) leaves.map_changed();
  }

  void start() {
    started = true;
    started_at = now;
    last_step = now;
    monitors.start(now);
    if (options.resume) return resume(*options.resume);
    look_around();
    interpreter.start();
  }

  void reckon_gap(double gap_s, const Committed& committed) {
    const Drift drift = drift_in(gap_s, committed);
    navigator.went_on(drift.by_W, drift.sigma_m, drift.surge);
    helm.begin_at(drift.surge);
  }

  void resume(const Resume& from) {
    const Committed& committed = from.committed;
    const double gap_s = gap_of(from, now, mission.max_gap_s.value);
    if (!from.gap_s) reckon_gap(gap_s, committed);
    outputs.estimate = last_estimate = navigator.update(now);
    started_at = now - from_seconds(committed.elapsed_s + gap_s);
    surroundings.restore(from.trail);
    look_around();
    if (committed.under_elapsed_s && !surroundings.open_above()) {
      surroundings.restore(
          Usable{started_at + from_seconds(*committed.under_elapsed_s), committed.under_battery});
    }
    for (const int action : committed.done_once) {
      done_once.at(static_cast<std::size_t>(action)) = true;
    }
    ladder.restore(committed.rung, committed.rung_cause);
    abort_cause = committed.abort_cause;
    paused = committed.paused;
    leaves.restore(committed.queries);
    restore_states(committed);
    outputs.transitions.push_back({"", innermost(), "", "the executive was restarted", ""});
    const bool is_missions = committed.rung < behaviors::Rung::kRetrace;
    if (is_missions &&
        (mission.resume == ResumePolicy::kSurface || gap_s > mission.max_gap_s.value)) {
      abort_cause = mission.resume == ResumePolicy::kSurface
                        ? "restarted, and the mission says surface"
                        : fmt::format("restarted after {:.0f} s, more than {:g} s", gap_s,
                                      mission.max_gap_s.value);
      dispatch(kAbortEvent, abort_cause);
    } else if (is_missions && mission.resume == ResumePolicy::kHold) {
      paused = true;
    }
  }

  void restore_states(const Committed& committed) {
    const statechart::Interpreter::Memory memory = memory_of(committed, machine.chart);
    interpreter.restore(memory);
    for (std::size_t i = 0; i < memory.active.size(); ++i) {
      const auto index = static_cast<std::size_t>(memory.active[i]);
      entered_at[index] = leaf_now() - from_seconds(committed.active_s.at(i));
      if (machine.chart.states[index].kind == statechart::StateKind::kAtomic) {
        leaves.enter(memory.active[i], committed.goals_done);
        refuse_to_surface_under_a_roof(memory.active[i]);
      }
    }
  }

  [[nodiscard]] Committed committed() const {
    Committed result;
    result.utime = now;
    result.elapsed_s = to_seconds(now - started_at);
    const statechart::Interpreter::Memory memory = interpreter.memory();
    keep_memory(memory, machine.chart, result);
    for (const StateId state : memory.active) {
      result.active_s.push_back(
          to_seconds(leaf_now() - entered_at[static_cast<std::size_t>(state)]));
    }
    for (std::size_t i = 0; i < done_once.size(); ++i) {
      if (done_once[i]) result.done_once.push_back(static_cast<int>(i));
    }
    result.X_WB = last_estimate.X_WB;
    result.v_W = last_estimate.X_WB.q * last_estimate.v_WB_B;
    result.sigma_m = estimation::horizontal_sigma(last_estimate);
    if (const std::optional<Usable>& usable = surroundings.last_in_open_water()) {
      result.under_elapsed_s = to_seconds(usable->at - started_at);
      result.under_battery = usable->battery_fraction;
    }
    if (leaves.active()) result.goals_done = leaves.behavior().goals_done();
    result.rung = ladder.rung();
    result.rung_cause = ladder.cause();
    result.abort_cause = abort_cause;
    result.paused = paused;
    result.queries = leaves.queries();
    return result;
  }

  // Where the vehicle is, as failsafes and guards want to know it.
  void look_around() {
    const double battery = monitors.health().battery_fraction;
    surroundings.look(now, estimate(), declared_roof(), battery);
    const behaviors::Progress& progress = leaves.progress();
    variables.depth = -position().z();
    variables.altitude =
        surroundings.altitude_m().value_or(std::numeric_limits<double>::infinity());
    variables.battery_fraction = battery;
    variables.temperature = monitors.health().temperature_c;
    variables.elapsed = to_seconds(now - started_at);
    variables.state_elapsed = state_elapsed();
    variables.distance_to_goal = progress.distance_to_go_m;
    variables.clearance = progress.clearance_m;
    variables.cross_track = progress.cross_track_m;
    variables.position_sigma = estimation::horizontal_sigma(estimate());
    variables.overhead = surroundings.is_under();
    variables.penetration = surroundings.trail().penetration_m();
    variables.spent = surroundings.spent(now, started_at, battery);
    variables.estimator = name_of(estimate().source);
  }

  // What a leaf that swims to its goals says is above its way.
  [[nodiscard]] std::optional<bool> declared_roof() const {
    const StateSpec* spec = leaves.active_spec();
    const bool has_goals =
        spec != nullptr && (std::holds_alternative<GotoState>(spec->leaf) ||
                            std::holds_alternative<GoalSequenceState>(spec->leaf));
    return has_goals ? std::optional(spec->overhead) : std::nullopt;
  }

  [[nodiscard]] double state_elapsed() const {
    for (std::size_t i = entered_at.size(); i-- > 0;) {
      if (interpreter.is_active(static_cast<StateId>(i))) {
        return to_seconds(leaf_now() - entered_at[i]);
      }
    }
    return 0.0;
  }

  void dispatch(const std::string& event, std::string cause) {
    event_cause = std::move(cause);
    evaluated.clear();
    const std::size_t before = outputs.transitions.size();
    interpreter.dispatch(event);
    DIVE_DEMAND(!interpreter.livelocked());
    if (outputs.transitions.size() == before && !evaluated.empty()) {
      note(fmt::format("{} leads nowhere: {}", event, describe_guards()));
    }
    variables.state_elapsed = state_elapsed();
  }

  /// An event that is worth a mention but not a state of its own.
  void tell(const std::string& event, const std::string& cause) {
    if (interpreter.running()) dispatch(event, cause);
  }

  void tell_switch() {
    const std::string cause = navigator.describe_switch();
    note("estimator " + cause);
    tell("estimator.switched", cause);
  }

  // The estimate follows slowly: nothing else is to be done. On a way that was swum before every
  // keyframe closes one, and that is no news.
  void tell_loop(const estimation::ClosedLoops& loops) {
    if (!goes_by_sight(mission)) return;
    if (std::exchange(loops_closed, loops.count) >= loops.count) return;
    if (loop_told && to_seconds(now - *loop_told) < kLoopNews && loops.moved_m < kLoopNews_m) {
      return;
    }
    loop_told = now;
    const std::string cause = fmt::format(
        "the place of {:.0f} s before is recognised: off by {:.3f} m and {:.2f} deg",
        to_seconds(loops.recognised - loops.seen), loops.moved_m, rad_to_deg(loops.turned_rad));
    note("loop closed: " + cause);
    tell("loop.closed", cause);
  }

  void note(std::string text) {
    outputs.actions.push_back({ActionRecord::Kind::kNote, std::move(text)});
  }

  void settle() {
    evaluated.clear();
    interpreter.settle();
    DIVE_DEMAND(!interpreter.livelocked());
  }

  [[nodiscard]] std::string describe_guards() const {
    std::string text;
    for (const auto& [guard, is_true] : evaluated) {
      if (!text.empty()) text += ", ";
      const Guard& of = machine.guards[static_cast<std::size_t>(guard)];
      text += fmt::format("{}: {} ({})", of.text(), is_true, of.describe(variables));
    }
    return text;
  }

  void obey(OperatorCommand command) {
    monitors.heartbeat(now);  // whatever topside says, it is there
    switch (command) {
      case OperatorCommand::kHeartbeat:
        return;
      case OperatorCommand::kAbort:
        operator_abort = true;
        return tell("abort", "topside says abort");
      case OperatorCommand::kPause:
        if (!std::exchange(paused, true)) tell("operator.pause", "topside says pause");
        return;
      case OperatorCommand::kResume:
        if (std::exchange(paused, false)) tell("operator.resume", "topside says resume");
        return;
      case OperatorCommand::kSkip:
        return skip();
    }
  }

  void skip() {
    const std::optional<StateId> leaf = leaves.active();
    if (leaves.active_spec() == nullptr) {
      return note("topside says skip, but the mission is not in command");
    }
    const std::string& id = machine.chart.states[static_cast<std::size_t>(*leaf)].id;
    tell("operator.skip", "topside says skip");
    if (leaves.active() != leaf || leaves.behavior().skip()) return;
    dispatch("done.state." + id, "topside says skip");
  }

  void climb_ladder() {
    behaviors::MonitorInput input;
    input.now = now;
    input.elapsed_s = variables.elapsed;
    input.estimate = &estimate();
    input.altitude_m = surroundings.altitude_m();
    input.command = last_command;
    input.expected_climb =
        (estimate().X_WB.q * Eigen::Vector3d(last_command.v, 0.0, expected_heave)).z();
    input.leg_elapsed_s = leaves.progress().elapsed_s;
    input.leg_expected_s = leaves.progress().expected_s;
    input.plan_failures = leaves.progress().plan_failures;
    input.out_of_replans = out_of_replans;
    input.operator_abort = operator_abort;
    input.retrace_failed = retrace_failed;
    input.rises = leaves.active() && leaves.behavior().rises();
    const auto change = ladder.update(now, monitors.update(input), can_go_up());
    if (change) take_rung(*change);
  }

  void take_rung(const behaviors::FailsafeLadder::Change& change) {
    FailsafeRecord record{
        behaviors::to_string(change.rung),
        std::string(behaviors::to_string(change.cause)),
        {},
        change.rung == behaviors::Rung::kNone ? "it is gone" : describe(change.cause)};
    if (change.escalated) record.why += ", and it did not pass";
    for (const FailsafeKind kind : change.competing) {
      if (!record.competing.empty()) record.competing += ", ";
      record.competing += behaviors::to_string(kind);
    }
    outputs.failsafes.push_back(record);
    held.reset();
    if (!interpreter.running() || change.rung == behaviors::Rung::kNone) return;
    const std::string cause = fmt::format("failsafe {}: {}", record.cause, record.why);
    dispatch("failsafe." + record.cause, cause);
    if (change.rung >= behaviors::Rung::kRetrace) {
      abort_cause = cause;
      paused = false;  // no pause keeps the vehicle from coming up
    }
    if (change.rung == behaviors::Rung::kRetrace) dispatch(kRetreatEvent, cause);
    if (change.rung == behaviors::Rung::kAbortAndSurface) dispatch(kAbortEvent, cause);
    if (change.rung == behaviors::Rung::kEmergencySurface) dispatch(kEmergencyEvent, cause);
  }

  [[nodiscard]] std::string describe(FailsafeKind kind) const {
    FailsafeFigures figures;
    figures.health = monitors.health();
    figures.altitude_m = surroundings.altitude_m();
    figures.p_W = position();
    figures.estimated_depth_m = variables.depth;
    figures.measured_depth_m = last_depth ? last_depth->depth_m : 0.0;
    figures.position_sigma_m = variables.position_sigma;
    figures.progress = &leaves.progress();
    figures.out_of_replans = out_of_replans;
    figures.retrace_failure = &retrace_failure;
    figures.internal_error = &internal_error;
    return mission::describe(kind, mission, figures);
  }

  void tell_timeouts() {
    for (std::size_t index = 0; index < entered_at.size(); ++index) {
      if (timeout_told[index] || machine.specs[index] == nullptr) continue;
      const std::optional<Timeout>& timeout = machine.specs[index]->timeout;
      if (!timeout || !interpreter.is_active(static_cast<StateId>(index))) continue;
      if (to_seconds(leaf_now() - entered_at[index]) <= timeout->seconds.value) continue;
      timeout_told[index] = true;
      const std::string& id = machine.chart.states[index].id;
      const std::string cause =
          fmt::format("{} took longer than {:g} s", id, timeout->seconds.value);
      if (abort_cause.empty()) abort_cause = cause;  // a timeout is never a success
      dispatch("timeout." + id, cause);
      return;  // the configuration has changed; others are told on the next tick
    }
  }

  void run_leaf() {
    if (is_held()) return hold();
    held.reset();
    const std::optional<StateId> leaf = leaves.active();
    if (!leaf) {  // the machine has ended
      const double depth = !surroundings.open_above() ? variables.depth
                           : hears_depth()            ? 0.0
                                                      : -1.0;  // to be pushed against
      last_command = behaviors::station_keeping(depth, to_rpy(estimate().X_WB.q).z());
      return;
    }
    behaviors::BehaviorInput input;
    input.now = leaf_now();
    input.estimate = &estimate();
    input.replan = ladder.rung() == behaviors::Rung::kReplan;
    input.depth_known = hears_depth();
    input.attitude_known = hears_imu();
    input.can_go_up = can_go_up();
    const behaviors::BehaviorOutput result = leaves.step(input, outputs.plan_query);
    last_command = result.command;
    behaviors::Behavior& behavior = leaves.behavior();
    const bool needs_sight = mission.unknown && behavior.needs_sight();
    if (needs_sight) sight.apply(now, leaf_now(), estimate(), last_command);
    if (result.done) {
      const std::string& id = machine.chart.states[static_cast<std::size_t>(*leaf)].id;
      dispatch("done.state." + id, id + " is done");
    }
    if (result.failed != behaviors::Failure::kNone) {
      leaf_failed(*leaf, result.failed);
    } else if (needs_sight && !result.done && sight.waits_in_vain(leaf_now()) &&
               !behavior.take_another_way()) {
      leaves.explain("the way that was planned leads where it cannot look");
      leaf_failed(*leaf, behaviors::Failure::kUnreachable);
    }
  }

  // Keeps the place where it was told to; what is answered meanwhile waits.
  void hold() {
    if (!held) {
      held =
          behaviors::station_keeping(std::max(variables.depth, 0.0), to_rpy(estimate().X_WB.q).z());
    }
    last_command = *held;
  }

  void leaf_failed(StateId leaf, behaviors::Failure failure) {
    const std::string id = machine.chart.states[static_cast<std::size_t>(leaf)].id;
    const StateSpec* spec = machine.specs[static_cast<std::size_t>(leaf)];
    const bool is_retrace = spec == nullptr || std::holds_alternative<RetraceState>(spec->leaf);
    if (is_retrace) {
      retrace_failed = true;  // the ladder takes it from here
      const std::string& why = leaves.progress().plan_failure;
      retrace_failure = why.empty() ? "the trail never saw open water" : why;
      return;
    }
    const bool is_exhausted = failure == behaviors::Failure::kExhausted;
    if (is_exhausted) out_of_replans = true;
    dispatch("plan.failed." + id,
             fmt::format("no plan for {}: {}", id,
                         is_exhausted ? "no replans are left" : leaves.progress().plan_failure));
  }

  void actuate() {
    outputs.command = last_command;
    const double dt = to_seconds(now - last_step);
    if (started && dt > 0.0 && last_imu && last_depth) {
      const double depth = hears_depth() ? last_depth->depth_m : -estimate().X_WB.p.z();
      helm.step(last_command, {&*last_imu, hears_imu(), depth, hears_depth()}, dt);
    }
    last_step = now;
    outputs.rates = helm.rates();
  }

  void fill_status() {
    const behaviors::Progress& progress = leaves.progress();
    Status& status = outputs.status;
    status.state = innermost();
    status.leg = progress.leg;
    status.distance_to_go_m = progress.distance_to_go_m;
    status.time_to_go_s = progress.distance_to_go_m / mission.speed.value;
    status.depth_m = -outputs.estimate.X_WB.p.z();
    status.clearance_m = progress.clearance_m;
    status.cross_track_m = progress.cross_track_m;
    status.segment = progress.segment;
    status.rung = behaviors::to_string(ladder.rung());
    status.finished = started && !interpreter.running();
  }

  [[nodiscard]] const std::string& innermost() const {
    for (std::size_t i = machine.chart.states.size(); i-- > 1;) {
      if (interpreter.is_active(static_cast<StateId>(i))) return machine.chart.states[i].id;
    }
    return final_state;
  }

  void refuse_to_surface_under_a_roof(StateId state) {
    const auto index = static_cast<std::size_t>(state);
    const StateSpec* spec = machine.specs[index];
    const bool surfaces = spec != nullptr && std::holds_alternative<SurfaceState>(spec->leaf);
    if (!surfaces || !surroundings.is_under()) return;
    abort_cause = event_cause = machine.chart.states[index].id + " was entered under an overhead";
    interpreter.raise(kAbortEvent);
  }

  const Mission& mission;
  ExecutiveOptions options;
  ChangedMap map;
  Machine machine;
  statechart::Interpreter interpreter;
  Surroundings surroundings;
  Leaves leaves;
  Navigator navigator;
  Helm helm;
  SurfacingFallback fallback;
  behaviors::Monitors monitors;
  behaviors::SightLimit sight;
  behaviors::FailsafeLadder ladder;

  // By StateId.
  std::vector<Utime> entered_at;  ///< On the behaviours' clock.
  std::vector<char> timeout_told;
  std::vector<char> done_once;  ///< By ActionId.

  Utime now = 0;
  Utime held_for = 0;
  Utime started_at = 0;
  Utime last_step = 0;
  Utime imu_heard = 0;
  Utime depth_heard = 0;
  bool started = false;
  bool paused = false;
  bool operator_abort = false;
  std::optional<vehicle::Command> held;
  estimation::StateEstimate last_estimate;
  std::optional<ImuSample> last_imu;
  std::optional<DepthSample> last_depth;
  vehicle::Command last_command;
  double expected_heave = 0.0;  ///< m/s
  GuardVariables variables;
  std::vector<std::pair<statechart::GuardId, bool>> evaluated;  ///< Since the last transition.
  bool out_of_replans = false;
  bool retrace_failed = false;
  std::string retrace_failure;
  int loops_closed = 0;
  std::optional<Utime> loop_told;
  std::string final_state;
  std::string abort_cause;
  std::string event_cause;
  std::string internal_error;
  StepOutputs outputs;  // of the last step, or so far of the one under way
};

Executive::Executive(const Mission& mission, const planning::World& world,
                     const vehicle::Model& model, ExecutiveOptions options)
    : impl_(std::make_unique<Impl>(mission, world, model, std::move(options))) {}
Executive::Executive(Executive&&) noexcept = default;
Executive& Executive::operator=(Executive&&) noexcept = default;
Executive::~Executive() = default;

const StepOutputs& Executive::step(const StepInputs& inputs) {
  Impl& impl = *impl_;
  if (impl.internal_error.empty()) {
    try {
      impl.step(inputs);
      return impl.outputs;
    } catch (const std::exception& error) {
      impl.internal_error = error.what();
      impl.abort_cause = fmt::format("failsafe internal_error: {}", error.what());
    }
  }
  return impl.outputs = impl.fallback.step(inputs, impl.abort_cause);
}

Committed Executive::committed() const { return impl_->committed(); }
const behaviors::Trail& Executive::trail() const { return impl_->surroundings.trail(); }

ExecutiveResult Executive::result() const {
  const Impl& impl = *impl_;
  ExecutiveResult result;
  result.cause = impl.abort_cause;
  if (!impl.internal_error.empty()) {
    result.outcome = Outcome::kAborted;
    result.final_state = kFallbackState;
    return result;
  }
  result.final_state = impl.innermost();
  if (!impl.started || impl.interpreter.running()) return result;
  const bool as_planned = impl.abort_cause.empty() && impl.final_state != kAbortedState;
  result.outcome = as_planned ? Outcome::kSuccess : Outcome::kAborted;
  return result;
}

}  // namespace dive::mission
