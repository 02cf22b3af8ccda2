#include "estimation/expected_motion.h"

#include <algorithm>
#include <cmath>

namespace dive::estimation {
namespace {

using Eigen::Vector3d;

constexpr double kCorrection_s = 0.7;       // t_z: the depth filter's rate lags about as much
const Vector3d kVariances(0.05, 0.3, 1.0);  // W: surge is known best
constexpr double kTypicalScale = 0.1;       // s: the vehicle that is not quite at rest has drag too

double signed_square(double x) { return std::abs(x) * x; }

}  // namespace

void ExpectedMotion::begin_at(double surge) {
  reference_ = surge;
  surge_thrust_ = signed_square(surge);
  heave_thrust_ = 0.0;
  v_B_ = {surge, 0.0, 0.0};
  surge_by_scale_ = surge;
}

void ExpectedMotion::begin_at(const Vector3d& v_B, const Eigen::Vector2d& efforts) {
  set_velocity(v_B);
  surge_thrust_ = efforts.x() * model_.full_speed * model_.full_speed;
  heave_thrust_ = efforts.y() * model_.full_heave * model_.full_heave;
}

void ExpectedMotion::set_velocity(const Vector3d& v_B) {
  reference_ = v_B.x();
  v_B_ = v_B;
  surge_by_scale_ = v_B.x();
}

double ExpectedMotion::thrust_for(double speed, double dt) {
  const double most = model_.full_speed * model_.full_speed;
  const double coast = model_.coast_m.x();
  if (speed == 0.0) reference_ = v_B_.x();
  const double drag = signed_square(reference_);
  const double wanted = (speed - reference_) / model_.speed_time_constant_s;
  const double thrust = std::clamp(drag + coast * wanted, -most, most);
  reference_ += (thrust - drag) / coast * dt;
  return thrust;
}

void ExpectedMotion::advance(const Propulsion& propulsion, const Vector3d& omega_B,
                             const Vector3d& up_B, double dt) {
  const MotionModel& m = model_;
  const double gain = 1.0 - std::exp(-dt / std::max(m.thrust_lag_s, 1e-9));
  const auto& efforts = propulsion.efforts;
  const Eigen::Vector2d before(surge_thrust_, heave_thrust_);
  const double surge_thrust =
      efforts ? efforts->x() * m.full_speed * m.full_speed : thrust_for(propulsion.speed, dt);
  surge_thrust_ += gain * (surge_thrust - surge_thrust_);
  if (efforts) {
    reference_ = v_B_.x();
    heave_thrust_ += gain * (efforts->y() * m.full_heave * m.full_heave - heave_thrust_);
  }
  // The midpoint rule: of Euler's, the error would look like some per cent of drag in a turn.
  const Eigen::Vector2d thrust = 0.5 * (before + Eigen::Vector2d(surge_thrust_, heave_thrust_));
  const double drag = std::max(2.0 * std::abs(v_B_.x()), kTypicalScale * std::abs(surge_by_scale_));
  surge_by_scale_ += dt * (2.0 * thrust.x() - drag * surge_by_scale_) / m.coast_m.x();
  const bool has_heave = efforts.has_value();
  const Vector3d middle = v_B_ + 0.5 * dt * rate(v_B_, thrust, omega_B, up_B, has_heave);
  v_B_ += dt * rate(middle, thrust, omega_B, up_B, has_heave);
}

Vector3d ExpectedMotion::rate(const Vector3d& v_B, const Eigen::Vector2d& thrust,
                              const Vector3d& omega_B, const Vector3d& up_B, bool has_heave) const {
  const MotionModel& m = model_;
  const double u = v_B.x();
  const double v = v_B.y();
  const double w = v_B.z();
  const double p = omega_B.x();
  const double q = omega_B.y();
  const double r = omega_B.z();
  const double mu_y = m.sway_mass_ratio;
  const double mu_z = m.heave_mass_ratio;
  const double tail = std::copysign(m.tail_m, u);
  Vector3d rate;
  rate.x() = (thrust.x() - signed_square(u)) / m.coast_m.x() + v * r / mu_y - w * q / mu_z +
             m.buoyancy * up_B.x();
  rate.y() = w * p * mu_y / mu_z - mu_y * u * r - signed_square(v) / m.coast_m.y() -
             std::abs(u) * (v - r * tail) / m.tail_lift_m.x() + mu_y * m.buoyancy * up_B.y();
  rate.z() = mu_z * u * q - v * p * mu_z / mu_y;
  if (has_heave) {
    rate.z() += (thrust.y() - signed_square(w)) / m.coast_m.z() -
                std::abs(u) * (w + q * tail) / m.tail_lift_m.y() + mu_z * m.buoyancy * up_B.z();
  }
  return rate;
}

void ExpectedMotion::correct(double height_rate, const Vector3d& up_B, double dt) {
  const Vector3d weighted = kVariances.cwiseProduct(up_B);
  const double gain = -std::expm1(-dt / kCorrection_s) / up_B.dot(weighted);
  v_B_ += gain * (height_rate - up_B.dot(v_B_)) * weighted;
}

}  // namespace dive::estimation
