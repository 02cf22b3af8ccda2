#include "vehicle/link/arbiter.h"

namespace dive::link {

using vehicle::ExitPhase;

Arbiter::Arbiter(const MotionModel& motion, double session_timeout_s)
    : executive_(session_timeout_s),
      supervisor_(session_timeout_s),
      autopilot_(vehicle::autopilot_options(motion)),
      guidance_(motion) {}

bool Arbiter::receive(const VehicleCommand& command, Utime now) {
  CommandGate& gate = command.source == Source::kSupervisor ? supervisor_ : executive_;
  return gate.receive(command, now) == CommandGate::Decision::kAccepted;
}

bool Arbiter::receive(const ExitPathMessage& message) {
  return executive_.is_from(message.session_id) && guidance_.set_exit_path(message.path);
}

// A supervisor that falls silent has given the vehicle back, or has died.
const CommandGate* Arbiter::current(Utime now) const {
  if (supervisor_.age_s(now) <= to_seconds(vehicle::kSupervised)) return &supervisor_;
  if (executive_.age_s(now) <= to_seconds(vehicle::kCommandStale)) return &executive_;
  const CommandGate& newest =
      supervisor_.age_s(now) < executive_.age_s(now) ? supervisor_ : executive_;
  return newest.age_s(now) <= to_seconds(vehicle::kCommandTimeout) ? &newest : nullptr;
}

Arbiter::CommandSource Arbiter::source(Utime now) const {
  const CommandGate* gate = current(now);
  if (gate == nullptr) return CommandSource::kNone;
  return gate == &supervisor_ ? CommandSource::kSupervisor : CommandSource::kExecutive;
}

vehicle::PseudoRates Arbiter::step(const std::optional<ImuSample>& imu,
                                   const std::optional<DepthSample>& depth, Utime now) {
  guidance_.observe(imu, depth, rates_, now);
  autopilot_.observe(imu, depth);
  rates_ = efforts(now);
  return rates_;
}

vehicle::PseudoRates Arbiter::efforts(Utime now) {
  if (const CommandGate* gate = current(now)) {
    guidance_.end();
    return execute(*gate->newest(), gate->age_s(now), guidance_.surge(), now, autopilot_);
  }
  // Before the first command there is no dive to end by surfacing.
  if (!executive_.newest() && !supervisor_.newest()) return {};
  if (guidance_.phase() == ExitPhase::kIdle) guidance_.begin(now);
  return autopilot_.step(guidance_.step(now), guidance_.surge(), now);
}

vehicle::PseudoRates execute(const VehicleCommand& command, double age_s, double surge, Utime now,
                             vehicle::OwnAutopilot& autopilot) {
  const bool is_stale = age_s > to_seconds(vehicle::kCommandStale);
  if (command.mode == Mode::kRates && !is_stale) {
    autopilot.release(now);
    return command.rates;
  }
  vehicle::Command kept = command.command;
  if (is_stale) kept.v = 0.0;
  return autopilot.step(kept, surge, now);
}

}  // namespace dive::link
