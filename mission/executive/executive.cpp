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
#include "behaviors/hold.h"
#include "behaviors/monitors.h"
#include "behaviors/retrace.h"
#include "behaviors/sight_limit.h"
#include "behaviors/surface.h"
#include "behaviors/trail.h"
#include "common/assert.h"
#include "mission/executive/changed_map.h"
#include "mission/executive/failsafe_words.h"
#include "mission/executive/leaf_behaviors.h"
#include "mission/executive/machine.h"
#include "mission/executive/navigator.h"
#include "mission/executive/surfacing_fallback.h"
#include "mission/statechart/interpreter.h"
#include "vehicle/reckoned_attitude.h"

namespace dive::mission {
namespace {

using behaviors::FailsafeKind;
using statechart::StateId;

constexpr double kSoundingPeriod = 0.5;  // s: looking for the ground takes a while
constexpr double kRetreatWait = 60.0;    // s in open water before a retreat ends in surfacing
constexpr Utime kSilence = 500'000;      // us, of the depth sensor: then the estimate stands in
constexpr Utime kBlind = 100'000;        // us without attitude: then no turning effort is made
constexpr double kDriftWhileAway = 0.2;  // m/s, one sigma: nobody steered
constexpr double kGoesOn =
    0.3;  // s after a commit that a vehicle swims on when nobody steers it ...
constexpr double kStops = 1.0;     // ... and the time constant, s, with which it then comes to rest
constexpr Utime kAhead = 100'000;  // us that a camera's clock may be before ours
constexpr double kTilted = 0.2;    // rad
constexpr double kLoopNews = 10.0;    // s after which a loop that is closed is news again, ...
constexpr double kLoopNews_m = 0.05;  // ... or when it moves the vehicle so far
constexpr double kDrift = 0.2;        // m that a vehicle at rest may drift on its way up

/// What there was when the vehicle was last in open water.
struct Usable {
  Utime at = 0;
  double battery_fraction = 1.0;
};

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
        leaf_context(make_leaf_context(mission_in, map.scene(), options.seed)),
        navigator(mission_in.estimator.value, options.estimator, first_position(), first_sigma()),
        autopilot(options.autopilot),
        fallback(options.autopilot),
        monitors(monitor_limits(mission_in)),
        sight(seen_ahead_options(mission_in)),
        ladder(mission_in.failsafes.policies),
        behaviors_by_state(machine.chart.states.size()),
        entered_at(machine.chart.states.size()),
        timeout_told(machine.chart.states.size()),
        done_once(machine.actions.size()) {
    evaluated.reserve(machine.guards.size());
    if (mission.unknown) declared.emplace();
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
      enter_leaf(entered_state.id, machine.specs[index], behaviors_by_state[index]);
    }
    if (outputs.transitions.empty()) {
      outputs.transitions.push_back({"", "", "", "the mission starts", ""});
    }
    outputs.transitions.back().to = entered_state.id;
  }
  void exited(StateId state) override {
    behaviors_by_state[static_cast<std::size_t>(state)].reset();
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
    bool map_changed = !inputs.seen.empty();
    if (map_changed) map.add(inputs.seen);
    if (inputs.map_update) map_changed |= look_at(*inputs.map_update);
    if (inputs.plan) kept_plan = *inputs.plan;
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
      run_leaf(map_changed);
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
    return open_above || (!is_under && !(hears_imu() && hears_depth()));
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
    const double lift = last_rates.heave - autopilot.trim_effort();
    expected_heave = vehicle::expected_heave(options.autopilot, lift, last_command.v);
    navigator.expect(last_command.v, expected_heave);
    outputs.estimate = navigator.update(now);
    last_estimate = outputs.estimate;
  }

  // True when the map has changed.
  bool look_at(const planning::MapUpdate& update) {
    if (update.scan_utime > now + kAhead || !map.apply(update)) return false;
    monitors.saw(update.scan_utime);
    navigator.moved(update.off_W);
    sight.hear(update.scan_utime, update.seen_ahead_m);
    return !update.cells.empty();
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

  // A vehicle whose clock went back was away for nobody knows how long: for too long.
  [[nodiscard]] double gap_of(const Resume& from) const {
    const double told = to_seconds(now - from.committed.utime);
    return from.gap_s.value_or(told >= 0.0 ? told : mission.max_gap_s.value + 1.0);
  }

  // It swam on and then stopped, by itself, as the link's vehicles do.
  void reckon_gap(const Committed& committed, double gap_s) {
    const double stopping = 1.0 - std::exp(-std::max(gap_s - kGoesOn, 0.0) / kStops);
    const double swam_s = std::min(gap_s, kGoesOn) + kStops * stopping;
    const double surge = (committed.X_WB.q.conjugate() * committed.v_W).x() * (1.0 - stopping);
    navigator.went_on(committed.v_W.head<2>() * swam_s, kDriftWhileAway * gap_s, surge);
    autopilot.begin_at(surge);
  }

  void resume(const Resume& from) {
    const Committed& committed = from.committed;
    const double gap_s = gap_of(from);
    if (!from.gap_s) reckon_gap(committed, gap_s);
    outputs.estimate = last_estimate = navigator.update(now);
    started_at = now - from_seconds(committed.elapsed_s + gap_s);
    for (const behaviors::Trail::Crumb& crumb : from.trail) {
      trail.add(crumb.p_W, crumb.open_above);
      if (declared) declared->add(crumb.p_W, crumb.open_above);
    }
    look_around();
    if (committed.under_elapsed_s && !open_above) {
      under_since =
          Usable{started_at + from_seconds(*committed.under_elapsed_s), committed.under_battery};
    }
    for (const int action : committed.done_once) {
      done_once.at(static_cast<std::size_t>(action)) = true;
    }
    ladder.restore(committed.rung, committed.rung_cause);
    abort_cause = committed.abort_cause;
    paused = committed.paused;
    queries = committed.queries;
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
    const auto find = [this](const std::string& id) {
      const StateId state = machine.chart.find(id);
      DIVE_DEMAND(state >= 0);
      return state;
    };
    statechart::Interpreter::Memory memory;
    memory.history.resize(machine.chart.states.size());
    for (const std::string& id : committed.active) memory.active.push_back(find(id));
    for (const auto& [id, states] : committed.history) {
      for (const std::string& state : states) {
        memory.history[static_cast<std::size_t>(find(id))].push_back(find(state));
      }
    }
    interpreter.restore(memory);
    for (std::size_t i = 0; i < memory.active.size(); ++i) {
      const auto index = static_cast<std::size_t>(memory.active[i]);
      entered_at[index] = leaf_now() - from_seconds(committed.active_s.at(i));
      const statechart::State& active = machine.chart.states[index];
      if (active.kind == statechart::StateKind::kAtomic) {
        enter_leaf(active.id, machine.specs[index], behaviors_by_state[index],
                   committed.goals_done);
      }
    }
  }

  [[nodiscard]] Committed committed() const {
    Committed result;
    result.utime = now;
    result.elapsed_s = to_seconds(now - started_at);
    const statechart::Interpreter::Memory memory = interpreter.memory();
    const auto id_of = [this](StateId state) -> const std::string& {
      return machine.chart.states[static_cast<std::size_t>(state)].id;
    };
    for (const StateId state : memory.active) {
      result.active.push_back(id_of(state));
      result.active_s.push_back(
          to_seconds(leaf_now() - entered_at[static_cast<std::size_t>(state)]));
    }
    for (std::size_t i = 0; i < memory.history.size(); ++i) {
      for (const StateId state : memory.history[i]) {
        result.history[machine.chart.states[i].id].push_back(id_of(state));
      }
    }
    for (std::size_t i = 0; i < done_once.size(); ++i) {
      if (done_once[i]) result.done_once.push_back(static_cast<int>(i));
    }
    result.X_WB = last_estimate.X_WB;
    result.v_W = last_estimate.X_WB.q * last_estimate.v_WB_B;
    result.sigma_m = estimation::horizontal_sigma(last_estimate);
    if (under_since) {
      result.under_elapsed_s = to_seconds(under_since->at - started_at);
      result.under_battery = under_since->battery_fraction;
    }
    if (const std::optional<StateId> leaf = active_leaf()) {
      result.goals_done = behaviors_by_state[static_cast<std::size_t>(*leaf)]->goals_done();
    }
    result.rung = ladder.rung();
    result.rung_cause = ladder.cause();
    result.abort_cause = abort_cause;
    result.paused = paused;
    result.queries = queries;
    return result;
  }

  // Where the vehicle is, as failsafes and guards want to know it.
  void look_around() {
    const Eigen::Vector3d& p_W = position();
    is_under = is_declared_under(p_W) || map.overhead(p_W, 0.0);
    const double margin = kDrift + estimation::horizontal_sigma(estimate());
    open_above = !is_under && !map.overhead(p_W, margin);
    trail.add(p_W, open_above);
    const double battery = monitors.health().battery_fraction;
    if (open_above) under_since = Usable{now, battery};
    if (next_sounding <= now) {
      next_sounding = now + from_seconds(kSoundingPeriod);
      const std::optional<double> ground = map.ground_below(p_W);
      altitude = ground ? std::optional(p_W.z() - *ground) : std::nullopt;
    }
    variables.depth = -p_W.z();
    variables.altitude = altitude.value_or(std::numeric_limits<double>::infinity());
    variables.battery_fraction = battery;
    variables.temperature = monitors.health().temperature_c;
    variables.elapsed = to_seconds(now - started_at);
    variables.state_elapsed = state_elapsed();
    variables.distance_to_goal = progress.distance_to_go_m;
    variables.clearance = progress.clearance_m;
    variables.cross_track = progress.cross_track_m;
    variables.position_sigma = estimation::horizontal_sigma(estimate());
    variables.overhead = is_under;
    variables.penetration = trail.penetration_m();
    variables.spent = spent();
    variables.estimator = name_of(estimate().source);
  }

  // A camera that looks down sees no roof: in unknown water what the mission declares counts. A
  // leaf that swims to its goals says what is above its way; whatever else is active, that way
  // knows.
  bool is_declared_under(const Eigen::Vector3d& p_W) {
    if (!declared) return false;
    const std::optional<StateId> leaf = active_leaf();
    const StateSpec* spec = leaf ? machine.specs[static_cast<std::size_t>(*leaf)] : nullptr;
    const bool has_goals =
        spec != nullptr && (std::holds_alternative<GotoState>(spec->leaf) ||
                            std::holds_alternative<GoalSequenceState>(spec->leaf));
    if (!has_goals && declared->size() > 0) return !declared->was_open_at(p_W);
    const bool is_overhead = has_goals && spec->overhead;
    declared->add(p_W, !is_overhead);
    return is_overhead;
  }

  [[nodiscard]] double state_elapsed() const {
    for (std::size_t i = entered_at.size(); i-- > 0;) {
      if (interpreter.is_active(static_cast<StateId>(i))) {
        return to_seconds(leaf_now() - entered_at[i]);
      }
    }
    return 0.0;
  }

  // Of the time or the energy that was usable where the overhead began, whichever is more.
  [[nodiscard]] double spent() const {
    if (open_above || !under_since) return 0.0;
    const double time_left =
        mission.limits.mission_timeout.value - to_seconds(under_since->at - started_at);
    const double charge_left = under_since->battery_fraction - mission.limits.battery_reserve.value;
    const double charge = under_since->battery_fraction - monitors.health().battery_fraction;
    const double time_share = time_left > 0.0 ? to_seconds(now - under_since->at) / time_left : 1.0;
    const double charge_share = charge_left > 0.0 ? std::max(charge, 0.0) / charge_left : 1.0;
    return std::max(time_share, charge_share);
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
    const std::optional<StateId> leaf = active_leaf();
    const bool is_missions = leaf && machine.specs[static_cast<std::size_t>(*leaf)] != nullptr;
    if (!is_missions) return note("topside says skip, but the mission is not in command");
    const std::string& id = machine.chart.states[static_cast<std::size_t>(*leaf)].id;
    tell("operator.skip", "topside says skip");
    behaviors::Behavior* behavior = behaviors_by_state[static_cast<std::size_t>(*leaf)].get();
    if (behavior == nullptr || behavior->skip()) return;
    dispatch("done.state." + id, "topside says skip");
  }

  void climb_ladder() {
    behaviors::MonitorInput input;
    input.now = now;
    input.elapsed_s = variables.elapsed;
    input.estimate = &estimate();
    input.altitude_m = altitude;
    input.command = last_command;
    input.expected_climb =
        (estimate().X_WB.q * Eigen::Vector3d(last_command.v, 0.0, expected_heave)).z();
    input.leg_elapsed_s = progress.elapsed_s;
    input.leg_expected_s = progress.expected_s;
    input.plan_failures = progress.plan_failures;
    input.out_of_replans = out_of_replans;
    input.operator_abort = operator_abort;
    input.retrace_failed = retrace_failed;
    const std::optional<StateId> leaf = active_leaf();
    input.rises = leaf && behaviors_by_state[static_cast<std::size_t>(*leaf)]->rises();
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
    figures.altitude_m = altitude;
    figures.p_W = position();
    figures.estimated_depth_m = variables.depth;
    figures.measured_depth_m = last_depth ? last_depth->depth_m : 0.0;
    figures.position_sigma_m = variables.position_sigma;
    figures.progress = &progress;
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

  // The innermost active state that has a behaviour; the document allows one at a time.
  [[nodiscard]] std::optional<StateId> active_leaf() const {
    for (std::size_t i = behaviors_by_state.size(); i-- > 0;) {
      if (behaviors_by_state[i]) return static_cast<StateId>(i);
    }
    return std::nullopt;
  }

  void run_leaf(bool map_changed) {
    if (is_held()) {
      map_changed_while_held |= map_changed;
      return hold();
    }
    held.reset();
    const std::optional<StateId> leaf = active_leaf();
    if (!leaf) {  // the machine has ended
      const double depth = !open_above     ? variables.depth
                           : hears_depth() ? 0.0
                                           : -1.0;  // to be pushed against
      last_command = behaviors::station_keeping(depth, to_rpy(estimate().X_WB.q).z());
      return;
    }
    const auto index = static_cast<std::size_t>(*leaf);
    const std::string& id = machine.chart.states[index].id;
    behaviors::Behavior& behavior = *behaviors_by_state[index];

    behaviors::PlanAnswer answer;
    const std::optional<PlanReply> reply = std::exchange(kept_plan, std::nullopt);
    const bool answered = reply && reply->id == asked_id && asked_by == *leaf;
    if (answered) answer = {reply->status, reply->reason, reply->waypoints, reply->clearance_m};
    behaviors::BehaviorInput input;
    input.now = leaf_now();
    input.estimate = &estimate();
    input.plan = answered ? &answer : nullptr;
    const bool was_changed = std::exchange(map_changed_while_held, false);
    input.map_changed = map_changed || was_changed;
    input.trail = &trail;
    input.seen = map.has_changed() ? &map : nullptr;
    input.replan = ladder.rung() == behaviors::Rung::kReplan;
    input.depth_known = hears_depth();
    input.attitude_known = hears_imu();
    input.can_go_up = can_go_up();
    behaviors::BehaviorOutput result = behavior.step(input);
    last_command = result.command;
    progress = behavior.progress();
    const bool needs_sight = mission.unknown && behavior.needs_sight();
    if (needs_sight) sight.apply(now, leaf_now(), estimate(), last_command);
    if (result.plan_request) {
      asked_id = ++queries;
      asked_by = *leaf;
      outputs.plan_query =
          PlanQuery{asked_id, id, result.plan_cause, std::move(*result.plan_request)};
    }
    if (result.done) dispatch("done.state." + id, id + " is done");
    if (result.failed != behaviors::Failure::kNone) {
      leaf_failed(*leaf, result.failed);
    } else if (needs_sight && !result.done && sight.waits_in_vain(leaf_now()) &&
               !behavior.take_another_way()) {
      progress.plan_failure = "the way that was planned leads where it cannot look";
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
      retrace_failure =
          progress.plan_failure.empty() ? "the trail never saw open water" : progress.plan_failure;
      return;
    }
    const bool is_exhausted = failure == behaviors::Failure::kExhausted;
    if (is_exhausted) out_of_replans = true;
    dispatch("plan.failed." + id,
             fmt::format("no plan for {}: {}", id,
                         is_exhausted ? "no replans are left" : progress.plan_failure));
  }

  void actuate() {
    outputs.command = last_command;
    const double dt = to_seconds(now - last_step);
    if (started && dt > 0.0 && last_imu && last_depth) {
      const double depth = hears_depth() ? last_depth->depth_m : -estimate().X_WB.p.z();
      if (hears_imu()) {
        reckoned.start(last_imu->q_WB, last_imu->gyro_B);
        last_rates = autopilot.step(last_command, last_imu->q_WB, last_imu->gyro_B, depth, dt);
      } else {
        actuate_blindly(depth, dt);
      }
    }
    last_step = now;
    outputs.rates = last_rates;
  }

  // Stops, comes level by what the turn must have become, and then does only what needs no
  // attitude: the depth loop, as if level. A tilted vehicle that heaves would push itself sideways.
  void actuate_blindly(double depth, double dt) {
    reckoned.advance(last_rates, dt);
    vehicle::Command command = last_command;
    command.v = 0.0;
    command.o = from_rpy(0.0, 0.0, to_rpy(last_imu->q_WB).z());
    if (reckoned.is_trusted()) {
      last_rates = autopilot.step(command, reckoned.q_WB(), reckoned.omega_B(), depth, dt);
      if (reckoned.tilt() > kTilted) last_rates.heave = 0.0;
    } else {
      last_rates = autopilot.step(command, command.o, Eigen::Vector3d::Zero(), depth, dt);
      // Blind and deaf: a vehicle that is left alone rises slowly, and pushes against nothing.
      if (!hears_depth() && command.d >= 0.0) last_rates = {};
    }
  }

  void fill_status() {
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

  void enter_leaf(const std::string& id, const StateSpec* spec,
                  std::unique_ptr<behaviors::Behavior>& behavior, int goals_done = 0) {
    if (spec != nullptr && std::holds_alternative<std::monostate>(spec->leaf)) return;  // watches
    progress = {};
    const bool is_retrace = spec != nullptr ? std::holds_alternative<RetraceState>(spec->leaf)
                                            : id == kRetraceState || id == kBackState;
    if (is_retrace) {
      behavior = std::make_unique<behaviors::Retrace>(trail, leaf_context.leg, &map);
    } else if (spec != nullptr) {
      behavior = make_leaf_behavior(leaf_context, *spec, goals_done);
      if (std::holds_alternative<SurfaceState>(spec->leaf) && is_under) {
        abort_cause = event_cause = id + " was entered under an overhead";
        interpreter.raise(kAbortEvent);
      }
    } else if (id == kWaitState) {
      behavior = std::make_unique<behaviors::Hold>(kRetreatWait);
    } else if (id == kEmergencyState) {
      behavior = std::make_unique<behaviors::Surface>();
    } else {
      behavior = make_surface(leaf_context);
    }
  }

  const Mission& mission;
  ExecutiveOptions options;
  ChangedMap map;
  Machine machine;
  statechart::Interpreter interpreter;
  LeafContext leaf_context;
  Navigator navigator;
  vehicle::Autopilot autopilot;
  vehicle::ReckonedAttitude reckoned;
  SurfacingFallback fallback;
  behaviors::Monitors monitors;
  behaviors::SightLimit sight;
  behaviors::FailsafeLadder ladder;
  behaviors::Trail trail;
  std::optional<behaviors::Trail> declared;  ///< In unknown water: by what the mission says.

  // By StateId.
  std::vector<std::unique_ptr<behaviors::Behavior>> behaviors_by_state;
  std::vector<Utime> entered_at;  ///< On the behaviours' clock.
  std::vector<char> timeout_told;
  std::vector<char> done_once;  ///< By ActionId.

  Utime now = 0;
  Utime held_for = 0;
  Utime started_at = 0;
  Utime last_step = 0;
  Utime next_sounding = 0;
  Utime imu_heard = 0;
  Utime depth_heard = 0;
  bool started = false;
  bool is_under = false;    ///< Something is above the vehicle.
  bool open_above = false;  ///< Nothing is, nor where it may drift to: it can go straight up.
  bool paused = false;
  bool operator_abort = false;
  bool map_changed_while_held = false;
  std::optional<vehicle::Command> held;
  std::optional<double> altitude;
  std::optional<Usable> under_since;
  estimation::StateEstimate last_estimate;
  std::optional<ImuSample> last_imu;
  std::optional<DepthSample> last_depth;
  vehicle::Command last_command;
  vehicle::PseudoRates last_rates;
  double expected_heave = 0.0;  ///< m/s
  GuardVariables variables;
  std::vector<std::pair<statechart::GuardId, bool>> evaluated;  ///< Since the last transition.
  behaviors::Progress progress;
  bool out_of_replans = false;
  bool retrace_failed = false;
  std::string retrace_failure;
  std::int64_t queries = 0;
  int loops_closed = 0;
  std::optional<Utime> loop_told;
  std::int64_t asked_id = 0;
  StateId asked_by = -1;
  std::optional<PlanReply> kept_plan;
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
const behaviors::Trail& Executive::trail() const { return impl_->trail; }

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
