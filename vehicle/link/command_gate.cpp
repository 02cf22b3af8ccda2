#include "vehicle/link/command_gate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vehicle/plausibility.h"

namespace dive::link {
namespace {

bool is_effort(double value) { return std::abs(value) <= 1.0; }  // false for NaN

bool is_sane(const VehicleCommand& command) {
  const auto& [v, h, d, o] = command.command;
  const auto& [surge, heave, roll, pitch, yaw] = command.rates;
  return std::isfinite(v) && std::isfinite(h) && std::abs(d) <= vehicle::kMaxPlausibleDepth &&
         vehicle::is_attitude(o) && is_effort(surge) && is_effort(heave) && is_effort(roll) &&
         is_effort(pitch) && is_effort(yaw);
}

// A difference of forged numbers must not overflow.
double difference(std::int64_t a, std::int64_t b) {
  return static_cast<double>(a) - static_cast<double>(b);
}

}  // namespace

CommandGate::Decision CommandGate::receive(const VehicleCommand& command, Utime now) {
  const Decision decision = evaluate(command, now);
  if (decision != Decision::kAccepted) {
    ++refused_;
    return decision;
  }
  if (!is_from(command.session_id)) ++sessions_;
  newest_ = command;
  arrived_at_ = now;
  return decision;
}

CommandGate::Decision CommandGate::evaluate(const VehicleCommand& command, Utime now) const {
  if (!is_sane(command)) return Decision::kImplausible;
  if (!newest_) return Decision::kAccepted;
  const double age = std::max(age_s(now), 0.0);
  if (command.session_id != newest_->session_id) {
    return age >= session_timeout_s_ ? Decision::kAccepted : Decision::kOtherSession;
  }
  if (command.sequence <= newest_->sequence || command.utime <= newest_->utime) {
    return Decision::kRepeated;
  }
  const double advance = 1e-6 * difference(command.utime, newest_->utime);
  const double commands = difference(command.sequence, newest_->sequence);
  const bool is_plausible =
      advance <= kMaxAdvance + kMaxRate * age && commands <= kMaxCommands + kMaxCommandRate * age;
  return is_plausible ? Decision::kAccepted : Decision::kImplausible;
}

double CommandGate::age_s(Utime now) const {
  if (!newest_) return std::numeric_limits<double>::infinity();
  return to_seconds(now - arrived_at_);
}

}  // namespace dive::link
