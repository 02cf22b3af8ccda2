#include "mission/executive/executive.h"

#include <exception>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/executive/behavior_factory.h"
#include "mission/executive/executive_impl.h"

namespace dive::mission {

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
      margin_monitor(model.hull, map.scene()),
      behavior(mission_in, machine, map, overhead_monitor.trail(), options.seed),
      localization(mission_in, model.motion, first_position(), first_sigma()),
      control(vehicle::autopilot_options(model.motion)),
      exit_path({.link_m = behaviors::kTrailLinkShare * mission_in.limits.clearance.value,
                 .speed = mission_in.speed.value,
                 .current_sigma = mission_in.priors.current},
                map),
      fallback(model.motion),
      monitors(monitor_limits(mission_in)),
      ladder(mission_in.failsafes.policies) {
  constexpr std::size_t kLongWay = 256;
  way.reserve(kLongWay);
}

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

void Executive::Impl::start() {
  started = true;
  started_at = last_step = situation.now;
  monitors.start(situation.now);
  if (options.resume) return resume(*options.resume);
  assess();
  runner.start();
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
  status.margin_sigma = situation.margin.margin_sigma;
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
void Executive::keep_imu_bias(const estimation::ImuBias& bias) { impl_->imu_bias = bias; }
const vehicle::ExitPath& Executive::exit_path() const { return impl_->exit_path.path(); }
std::vector<Pose> Executive::way_ahead(double seconds) const {
  std::vector<Pose> way;
  const bool is_behaving = impl_->situation.internal_error.empty() && impl_->behavior.state();
  if (impl_->situation.estimate.valid && is_behaving) {
    impl_->behavior.behavior().way_ahead(impl_->situation.estimate.X_WB, seconds, way);
  }
  return way;
}
const behaviors::Trail& Executive::trail() const { return impl_->overhead_monitor.trail(); }
ExecutiveResult Executive::result() const { return impl_->result(); }

}  // namespace dive::mission
