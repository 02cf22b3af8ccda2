#include "mission/executive/executive.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "behaviors/failsafes.h"
#include "behaviors/retrace.h"
#include "behaviors/surface.h"
#include "behaviors/trail.h"
#include "common/assert.h"
#include "mission/executive/leaf_behaviors.h"
#include "mission/executive/machine.h"
#include "mission/executive/surfacing_fallback.h"
#include "mission/statechart/interpreter.h"
#include "planning/world/scene.h"
#include "planning/world/sounding.h"

namespace dive::mission {
namespace {

using behaviors::FailsafeKind;
using statechart::StateId;

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
  Impl(const Mission& mission_in, const planning::World& world_in, const vehicle::Model& model,
       ExecutiveOptions options_in)
      : mission(mission_in),
        world(world_in),
        options(std::move(options_in)),
        scene(world_in),
        machine(build_machine(mission_in)),
        interpreter(machine.chart, *this),
        leaf_context(make_leaf_context(mission_in, scene, options.seed)),
        estimator(options.estimator,
                  mission_in.start.in_world(ground_height(scene, mission_in.start)),
                  options.start_sigma_m),
        autopilot(options.autopilot),
        fallback(options.autopilot),
        hull_radius(model.hull.radius()),
        ladder(failsafe_policies(mission_in.failsafes)),
        behaviors_by_state(machine.chart.states.size()),
        entered_at(machine.chart.states.size()),
        timeout_told(machine.chart.states.size()) {}

  // --- statechart::Environment ---

  bool evaluate(statechart::GuardId guard) override {
    return machine.guards[static_cast<std::size_t>(guard)].evaluate(guard_variables());
  }
  void execute(statechart::ActionId) override { DIVE_DEMAND(false); }  // missions have no actions

  void entered(StateId state) override {
    const auto index = static_cast<std::size_t>(state);
    const statechart::State& entered_state = machine.chart.states[index];
    entered_at[index] = now;
    timeout_told[index] = false;
    if (entered_state.kind == statechart::StateKind::kFinal) {
      if (entered_state.parent == 0) final_state = entered_state.id;
    } else if (entered_state.kind == statechart::StateKind::kAtomic) {
      enter_leaf(entered_state.id, machine.specs[index], behaviors_by_state[index]);
    }
    if (outputs->transitions.empty()) {
      outputs->transitions.push_back({"", "", "", "the mission starts"});
    }
    outputs->transitions.back().to = entered_state.id;
  }
  void exited(StateId state) override {
    behaviors_by_state[static_cast<std::size_t>(state)].reset();
  }
  void taken(int /*transition*/, const std::string& event) override {
    const std::string here = innermost();
    outputs->transitions.push_back(
        {here, here, event, event.empty() ? "its guard became true" : event_cause});
  }

  // --- one step ---

  StepOutputs step(const StepInputs& inputs) {
    StepOutputs step_outputs;
    outputs = &step_outputs;
    DIVE_DEMAND(!started || inputs.now >= now);
    now = inputs.now;
    sense(inputs);
    if (estimate().valid) {
      if (!started) start();
      open_above = !world.overhead(estimate().X_WB.p, hull_radius);
      trail.add(estimate().X_WB.p, open_above);
      climb_ladder();
      tell_timeouts();
      if (interpreter.running()) interpreter.settle();
      run_leaf(inputs.plan);
    }
    actuate();
    fill_status();
    outputs = nullptr;
    return step_outputs;
  }

  [[nodiscard]] const estimation::StateEstimate& estimate() const { return outputs->estimate; }

  void sense(const StepInputs& inputs) {
    if (inputs.imu) {
      estimator.add(*inputs.imu);
      last_imu = *inputs.imu;
    }
    if (inputs.depth) {
      estimator.add(*inputs.depth);
      last_depth = *inputs.depth;
    }
    if (inputs.health) last_health = *inputs.health;
    estimator.set_commanded_speed(last_command.v);
    outputs->estimate = estimator.update(now);
  }

  void start() {
    started = true;
    started_at = now;
    last_step = now;
    interpreter.start();
  }

  void dispatch(const std::string& event, std::string cause) {
    event_cause = std::move(cause);
    interpreter.dispatch(event);
    DIVE_DEMAND(!interpreter.livelocked());
  }

  void climb_ladder() {
    behaviors::FailsafeConditions conditions{};
    const auto set = [&conditions](FailsafeKind kind, bool value) {
      conditions[static_cast<std::size_t>(kind)] = value;
    };
    set(FailsafeKind::kLeak, last_health.leak);
    set(FailsafeKind::kOvertime,
        to_seconds(now - started_at) > mission.limits.mission_timeout.value);
    set(FailsafeKind::kOverdepth, -estimate().X_WB.p.z() > mission.limits.max_depth.value);
    set(FailsafeKind::kPlannerFailure,
        out_of_replans || plan_failures >= mission.failsafes.planner_failures.value);
    set(FailsafeKind::kRetraceFailure, retrace_failed);
    const auto change = ladder.update(now, conditions);
    if (change) take_rung(*change);
  }

  void take_rung(const behaviors::FailsafeLadder::Change& change) {
    FailsafeRecord record{
        behaviors::to_string(change.rung), behaviors::to_string(change.cause), {}};
    for (const FailsafeKind kind : change.competing) {
      if (!record.competing.empty()) record.competing += ", ";
      record.competing += behaviors::to_string(kind);
    }
    outputs->failsafes.push_back(record);
    if (!interpreter.running()) return;
    const std::string cause = fmt::format("failsafe {}: {}", record.cause, describe(change.cause));
    dispatch("failsafe." + record.cause, cause);
    if (change.rung >= behaviors::Rung::kAbortAndSurface) abort_cause = cause;
    if (change.rung == behaviors::Rung::kAbortAndSurface) dispatch(kAbortEvent, cause);
    if (change.rung == behaviors::Rung::kEmergencySurface) dispatch(kEmergencyEvent, cause);
  }

  std::string describe(FailsafeKind kind) const {
    switch (kind) {
      case FailsafeKind::kLeak:
        return "water in the hull";
      case FailsafeKind::kOvertime:
        return fmt::format("longer than {:g} s under way", mission.limits.mission_timeout.value);
      case FailsafeKind::kOverdepth:
        return fmt::format("deeper than {:g} m", mission.limits.max_depth.value);
      case FailsafeKind::kPlannerFailure:
        return out_of_replans ? "no replans are left for this leg"
                              : fmt::format("{} plans failed in a row, the last one: {}",
                                            plan_failures, plan_failure);
      case FailsafeKind::kRetraceFailure:
        return "the way out could not be swum";
      case FailsafeKind::kInternalError:
        return internal_error;
    }
    return {};
  }

  void tell_timeouts() {
    for (const StateId state : interpreter.configuration()) {
      const auto index = static_cast<std::size_t>(state);
      const Timeout* timeout =
          machine.specs[index] == nullptr ? nullptr : timeout_of(*machine.specs[index]);
      if (timeout == nullptr || timeout_told[index]) continue;
      if (to_seconds(now - entered_at[index]) <= timeout->seconds.value) continue;
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

  void run_leaf(const std::optional<PlanReply>& reply) {
    const std::optional<StateId> leaf = active_leaf();
    if (!leaf) {  // the machine has ended
      const double depth = open_above ? 0.0 : -estimate().X_WB.p.z();
      last_command = behaviors::station_keeping(depth, to_rpy(estimate().X_WB.q).z());
      return;
    }
    const auto index = static_cast<std::size_t>(*leaf);
    const std::string& id = machine.chart.states[index].id;
    behaviors::Behavior& behavior = *behaviors_by_state[index];

    behaviors::PlanAnswer answer;
    const bool answered = reply && reply->id == asked_id && asked_by == *leaf;
    if (answered) answer = {reply->status, reply->reason, reply->waypoints, reply->clearance_m};
    behaviors::BehaviorOutput result =
        behavior.step({now, &estimate(), answered ? &answer : nullptr});
    last_command = result.command;
    progress = behavior.progress();
    plan_failures = progress.plan_failures;
    plan_failure = progress.plan_failure;
    if (result.plan_request) {
      asked_id = ++queries;
      asked_by = *leaf;
      outputs->plan_query = PlanQuery{asked_id, id, std::move(*result.plan_request)};
    }
    if (result.done) dispatch("done.state." + id, id + " is done");
    if (result.failed) leaf_failed(id);
  }

  void leaf_failed(const std::string& id) {
    if (id == kRetraceState) {
      retrace_failed = true;  // the ladder takes it from here
    } else {
      out_of_replans = true;
      dispatch("plan.failed." + id, fmt::format("no plan for {}: {}", id, plan_failure));
    }
  }

  void actuate() {
    outputs->command = last_command;
    const double dt = to_seconds(now - last_step);
    if (started && dt > 0.0 && last_imu && last_depth) {
      last_rates =
          autopilot.step(last_command, last_imu->q_WB, last_imu->gyro_B, last_depth->depth_m, dt);
    }
    last_step = now;
    outputs->rates = last_rates;
  }

  void fill_status() {
    Status& status = outputs->status;
    status.state = innermost();
    status.leg = progress.leg;
    status.distance_to_go_m = progress.distance_to_go_m;
    status.time_to_go_s = progress.distance_to_go_m / mission.speed.value;
    status.depth_m = -outputs->estimate.X_WB.p.z();
    status.clearance_m = progress.clearance_m;
    status.cross_track_m = progress.cross_track_m;
    status.segment = progress.segment;
    status.rung = behaviors::to_string(ladder.rung());
    status.finished = started && !interpreter.running();
  }

  [[nodiscard]] std::string innermost() const {
    const std::vector<StateId> active = interpreter.configuration();
    if (!active.empty()) return machine.chart.states[static_cast<std::size_t>(active.back())].id;
    return final_state;
  }

  GuardVariables guard_variables() {
    GuardVariables variables;
    const Eigen::Vector3d& p_W = estimate().X_WB.p;
    variables.depth = -p_W.z();
    const std::optional<double> ground = planning::ground_below(scene, p_W);
    variables.altitude = ground ? p_W.z() - *ground : std::numeric_limits<double>::infinity();
    variables.battery_fraction = last_health.battery_fraction;
    variables.elapsed = to_seconds(now - started_at);
    const std::vector<StateId> active = interpreter.configuration();
    if (!active.empty()) {
      variables.state_elapsed =
          to_seconds(now - entered_at[static_cast<std::size_t>(active.back())]);
    }
    variables.distance_to_goal = progress.distance_to_go_m;
    variables.clearance = progress.clearance_m;
    variables.overhead = !open_above;
    return variables;
  }

  void enter_leaf(const std::string& id, const StateSpec* spec,
                  std::unique_ptr<behaviors::Behavior>& behavior) {
    if (spec != nullptr && std::holds_alternative<std::monostate>(spec->leaf)) return;  // watches
    progress = {};
    if (spec != nullptr) {
      behavior = make_leaf_behavior(leaf_context, *spec);
      if (std::holds_alternative<SurfaceState>(spec->leaf) && !open_above) {
        abort_cause = event_cause = id + " was entered under an overhead";
        interpreter.raise(kAbortEvent);
      }
    } else if (id == kRetraceState) {
      behavior = std::make_unique<behaviors::Retrace>(trail, estimate().X_WB.p, open_above,
                                                      mission.speed.value);
    } else {
      behavior = std::make_unique<behaviors::Surface>();
    }
  }

  const Mission& mission;
  const planning::World& world;
  ExecutiveOptions options;
  planning::Scene scene;
  Machine machine;
  statechart::Interpreter interpreter;
  LeafContext leaf_context;
  estimation::PrimitiveEstimator estimator;
  vehicle::Autopilot autopilot;
  SurfacingFallback fallback;
  double hull_radius;
  behaviors::FailsafeLadder ladder;
  behaviors::Trail trail;

  // By StateId.
  std::vector<std::unique_ptr<behaviors::Behavior>> behaviors_by_state;
  std::vector<Utime> entered_at;
  std::vector<char> timeout_told;

  Utime now = 0;
  Utime started_at = 0;
  Utime last_step = 0;
  bool started = false;
  bool open_above = false;
  std::optional<ImuSample> last_imu;
  std::optional<DepthSample> last_depth;
  HealthSample last_health;
  vehicle::Command last_command;
  vehicle::PseudoRates last_rates;
  behaviors::Progress progress;
  int plan_failures = 0;
  std::string plan_failure;
  bool out_of_replans = false;
  bool retrace_failed = false;
  std::int64_t queries = 0;
  std::int64_t asked_id = 0;
  StateId asked_by = -1;
  std::string final_state;
  std::string abort_cause;
  std::string event_cause;
  std::string internal_error;
  StepOutputs* outputs = nullptr;  // of the step under way
};

Executive::Executive(const Mission& mission, const planning::World& world,
                     const vehicle::Model& model, ExecutiveOptions options)
    : impl_(std::make_unique<Impl>(mission, world, model, std::move(options))) {}
Executive::Executive(Executive&&) noexcept = default;
Executive& Executive::operator=(Executive&&) noexcept = default;
Executive::~Executive() = default;

StepOutputs Executive::step(const StepInputs& inputs) {
  Impl& impl = *impl_;
  if (impl.internal_error.empty()) {
    try {
      return impl.step(inputs);
    } catch (const std::exception& error) {
      impl.internal_error = error.what();
      impl.abort_cause = fmt::format("failsafe internal_error: {}", error.what());
    }
  }
  return impl.fallback.step(inputs, impl.abort_cause);
}

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
