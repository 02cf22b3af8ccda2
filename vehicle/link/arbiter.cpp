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

bool Arbiter::hear(const VehicleCommand& command, Utime now) {
  const std::optional<VehicleCommand>& last = heard_[index_of(command.source)];
  const bool is_newer = !last || command.utime > last->utime ||
                        (command.utime == last->utime && command.sequence > last->sequence);
  if (!is_newer || to_seconds(command.utime - now) > kMaxAhead || !is_sane(command)) {
    ++refused_;
    return false;
  }
  heard_[index_of(command.source)] = command;
  heard_at_[index_of(command.source)] = now;
  return true;
}

Arbiter::Obeys Arbiter::obeys(Utime now) const {
  const auto speaks = [&](Source source) {
    return heard_[index_of(source)] && to_seconds(now - heard_at_[index_of(source)]) <= kTimeout;
  };
  if (speaks(Source::kSupervisor)) return Obeys::kSupervisor;
  return speaks(Source::kExecutive) ? Obeys::kExecutive : Obeys::kNobody;
}

const VehicleCommand* Arbiter::current(Utime now) const {
  switch (obeys(now)) {
    case Obeys::kSupervisor:
      return &*heard_[index_of(Source::kSupervisor)];
    case Obeys::kExecutive:
      return &*heard_[index_of(Source::kExecutive)];
    case Obeys::kNobody:
      break;
  }
  return nullptr;
}

vehicle::PseudoRates Arbiter::step(const std::optional<ImuSample>& imu,
                                   const std::optional<DepthSample>& depth, Utime now) {
  if (imu) imu_ = imu;
  if (depth) depth_ = depth;
  const VehicleCommand* heard = current(now);
  const bool is_stale =
      heard != nullptr && to_seconds(now - heard_at_[index_of(heard->source)]) > kStale;
  const double dt = last_step_ ? to_seconds(now - *last_step_) : 0.0;
  last_step_ = now;
  if (heard != nullptr && heard->mode == Mode::kRates && !is_stale) {
    if (imu_) yaw_ = to_rpy(imu_->q_WB).z();
    return heard->rates;
  }
  // Before the first command there is no dive to end by surfacing.
  const bool was_commanded = heard_[0] || heard_[1];
  if (!was_commanded || !imu_ || !depth_ || dt <= 0.0) return {};
  vehicle::Command command;
  command.o = from_rpy(0.0, 0.0, yaw_);
  if (heard != nullptr) command = heard->command;
  if (is_stale) command.v = 0.0;
  return autopilot_.step(command, imu_->q_WB, imu_->gyro_B, depth_->depth_m, dt);
}

}  // namespace dive::link
