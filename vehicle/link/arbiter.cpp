#include "vehicle/link/arbiter.h"

namespace dive::link {

using vehicle::ExitPhase;

Arbiter::Arbiter(vehicle::AutopilotOptions autopilot, double session_timeout_s)
    : executive_(session_timeout_s), supervisor_(session_timeout_s), autopilot_(autopilot) {}

bool Arbiter::receive(const VehicleCommand& command, Utime now) {
  CommandGate& gate = command.source == Source::kSupervisor ? supervisor_ : executive_;
  return gate.receive(command, now) == CommandGate::Decision::kAccepted;
}

bool Arbiter::receive(const ExitPathMessage& message) {
  return executive_.is_from(message.session_id) && guidance_.set_exit_path(message.path);
}

// A supervisor that falls silent has given the vehicle back, or has died.
const CommandGate* Arbiter::current(Utime now) const {
  if (supervisor_.age_s(now) <= kSupervised) return &supervisor_;
  if (executive_.age_s(now) <= kStale) return &executive_;
  const CommandGate& newest =
      supervisor_.age_s(now) < executive_.age_s(now) ? supervisor_ : executive_;
  return newest.age_s(now) <= kTimeout ? &newest : nullptr;
}

Arbiter::CommandSource Arbiter::source(Utime now) const {
  const CommandGate* gate = current(now);
  if (gate == nullptr) return CommandSource::kNone;
  return gate == &supervisor_ ? CommandSource::kSupervisor : CommandSource::kExecutive;
}

vehicle::PseudoRates Arbiter::step(const std::optional<ImuSample>& imu,
                                   const std::optional<DepthSample>& depth, Utime now) {
  if (imu) imu_ = imu;
  if (depth) depth_ = depth;
  const CommandGate* gate = current(now);
  const bool is_stale = gate != nullptr && gate->age_s(now) > kStale;
  const double dt = last_step_ ? to_seconds(now - *last_step_) : 0.0;
  last_step_ = now;
  const double speed = gate != nullptr && !is_stale ? gate->newest()->command.v : 0.0;
  guidance_.observe(imu, depth, speed, now);
  // Before the first command there is no dive to end by surfacing.
  if (!executive_.newest() && !supervisor_.newest()) return {};
  if (gate == nullptr) {
    if (guidance_.phase() == ExitPhase::kIdle) guidance_.begin(now);
    return steer(guidance_.step(now), dt);
  }
  guidance_.end();
  const VehicleCommand& command = *gate->newest();
  if (command.mode == Mode::kRates && !is_stale) {
    steers_itself_ = false;
    return command.rates;
  }
  vehicle::Command kept = command.command;
  if (is_stale) kept.v = 0.0;
  return steer(kept, dt);
}

// The autopilot takes over a vehicle that moves: it brakes from the speed that it has.
vehicle::PseudoRates Arbiter::steer(const vehicle::Command& command, double dt) {
  if (!imu_ || !depth_ || dt <= 0.0) return {};
  if (!steers_itself_ || command.v == 0.0) autopilot_.begin_at(guidance_.surge());
  steers_itself_ = true;
  return autopilot_.step(command, imu_->q_WB, imu_->gyro_B, depth_->depth_m, dt);
}

}  // namespace dive::link
