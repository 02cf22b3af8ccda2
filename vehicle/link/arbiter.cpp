#include "vehicle/link/arbiter.h"

#include <cmath>

namespace dive::link {
namespace {

constexpr double kSameQuaternion = 0.1;  // deviation of the norm from 1

bool is_effort(double value) { return std::abs(value) <= 1.0; }  // false for NaN

bool is_sane(const VehicleCommand& command) {
  const auto& [v, h, d, o] = command.command;
  const auto& [surge, heave, roll, pitch, yaw] = command.rates;
  return std::isfinite(v) && std::isfinite(h) && std::abs(d) <= Arbiter::kMaxDepth &&
         std::abs(o.norm() - 1.0) <= kSameQuaternion && is_effort(surge) && is_effort(heave) &&
         is_effort(roll) && is_effort(pitch) && is_effort(yaw);
}

std::size_t index_of(Source source) { return static_cast<std::size_t>(source); }

}  // namespace

Arbiter::Arbiter(vehicle::AutopilotOptions autopilot) : autopilot_(autopilot) {}

bool Arbiter::receive(const VehicleCommand& command, Utime now) {
  const std::optional<VehicleCommand>& last = commands_[index_of(command.source)];
  const bool is_newer = !last || command.utime > last->utime ||
                        (command.utime == last->utime && command.sequence > last->sequence);
  if (!is_newer || to_seconds(command.utime - now) > kMaxAhead || !is_sane(command)) {
    ++refused_;
    return false;
  }
  commands_[index_of(command.source)] = command;
  arrived_at_[index_of(command.source)] = now;
  return true;
}

Arbiter::CommandSource Arbiter::source(Utime now) const {
  const auto speaks = [&](Source source) {
    return commands_[index_of(source)] &&
           to_seconds(now - arrived_at_[index_of(source)]) <= kTimeout;
  };
  if (speaks(Source::kSupervisor)) return CommandSource::kSupervisor;
  return speaks(Source::kExecutive) ? CommandSource::kExecutive : CommandSource::kNone;
}

const VehicleCommand* Arbiter::current(Utime now) const {
  switch (source(now)) {
    case CommandSource::kSupervisor:
      return &*commands_[index_of(Source::kSupervisor)];
    case CommandSource::kExecutive:
      return &*commands_[index_of(Source::kExecutive)];
    case CommandSource::kNone:
      break;
  }
  return nullptr;
}

vehicle::PseudoRates Arbiter::step(const std::optional<ImuSample>& imu,
                                   const std::optional<DepthSample>& depth, Utime now) {
  if (imu) imu_ = imu;
  if (depth) depth_ = depth;
  const VehicleCommand* command = current(now);
  const bool is_stale =
      command != nullptr && to_seconds(now - arrived_at_[index_of(command->source)]) > kStale;
  const double dt = last_step_ ? to_seconds(now - *last_step_) : 0.0;
  last_step_ = now;
  if (command != nullptr && command->mode == Mode::kRates && !is_stale) {
    if (imu_) yaw_ = to_rpy(imu_->q_WB).z();
    return command->rates;
  }
  // Before the first command there is no dive to end by surfacing.
  const bool was_commanded = commands_[0] || commands_[1];
  if (!was_commanded || !imu_ || !depth_ || dt <= 0.0) return {};
  vehicle::Command kept;
  kept.o = from_rpy(0.0, 0.0, yaw_);
  if (command != nullptr) kept = command->command;
  if (is_stale) kept.v = 0.0;
  return autopilot_.step(kept, imu_->q_WB, imu_->gyro_B, depth_->depth_m, dt);
}

}  // namespace dive::link
