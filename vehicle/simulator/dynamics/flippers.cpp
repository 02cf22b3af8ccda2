#include "vehicle/simulator/dynamics/flippers.h"

#include <algorithm>
#include <cmath>

namespace dive::vehicle {
namespace {

constexpr double kMiddle = 0.1;  // m: hips nearer than this to the middle have no part in pitch

double sign(double x) { return x < 0.0 ? -1.0 : 1.0; }

double clamped(double rate) { return std::isnan(rate) ? 0.0 : std::clamp(rate, -1.0, 1.0); }

}  // namespace

Flippers::Flippers(const FlipperForces& hips_B, const Aqua2Figures& figures)
    : hips_B_(hips_B), figures_(figures) {}

void Flippers::command(const PseudoRates& rates) {
  const double surge = figures_.flipper_thrust(figures_.surge_amplitude) * clamped(rates.surge);
  const double heave = figures_.flipper_thrust(figures_.heave_amplitude) * clamped(rates.heave);
  const double roll = figures_.flipper_thrust(figures_.roll_amplitude) * clamped(rates.roll);
  const double pitch = figures_.flipper_thrust(figures_.pitch_amplitude) * clamped(rates.pitch);
  const double yaw = figures_.flipper_thrust(figures_.yaw_amplitude) * clamped(rates.yaw);
  const double most = figures_.flipper_thrust(figures_.max_amplitude);
  for (int i = 0; i < hips_B_.cols(); ++i) {
    const double x = hips_B_(0, i);
    const double left = sign(hips_B_(1, i));
    const double end = std::abs(x) < kMiddle ? 0.0 : sign(x);
    Eigen::Vector3d force(surge_scale_ * surge - left * yaw, 0.0,
                          heave + left * roll - end * pitch);
    const double size = force.norm();
    demand_.col(i) = size > most ? Eigen::Vector3d(force * (most / size)) : force;
  }
}

void Flippers::advance(double dt) {
  forces_ += -std::expm1(-dt / figures_.motor_lag_s) * (demand_ - forces_);
}

double Flippers::power() const {
  double total = 0.0;
  for (int i = 0; i < forces_.cols(); ++i) {
    const double force = forces_.col(i).norm();
    total += force * std::sqrt(force);
  }
  return figures_.thrust_power * total;
}

}  // namespace dive::vehicle
