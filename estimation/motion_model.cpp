#include "estimation/motion_model.h"

#include <algorithm>
#include <cmath>

#include "common/range_check.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;

constexpr double kCorrection_s = 0.7;       // t_z: the depth filter's rate lags about as much
const Vector3d kVariances(0.05, 0.3, 1.0);  // W: surge is known best

double signed_square(double x) { return std::abs(x) * x; }

}  // namespace

std::string MotionModel::validate() const {
  RangeCheck check;
  check("speed_time_constant_s", speed_time_constant_s, 0.05, 60.0);
  check("full_speed", full_speed, 0.05, 5.0);
  check("full_heave", full_heave, 0.01, 5.0);
  check("thrust_lag_s", thrust_lag_s, 0.0, 10.0);
  for (const double coast : coast_m) check("coast_m", coast, 0.1, 100.0);
  check("sway_mass_ratio", sway_mass_ratio, 0.1, 10.0);
  check("heave_mass_ratio", heave_mass_ratio, 0.1, 10.0);
  for (const double lift : tail_lift_m) check("tail_lift_m", lift, 0.1, 1e6);
  check("tail_m", tail_m, 0.0, 10.0);
  check("buoyancy", buoyancy, -1.0, 1.0);
  return check.problem();
}

void ExpectedMotion::begin_at(double surge) {
  reference_ = surge;
  surge_thrust_ = signed_square(surge);
  heave_thrust_ = 0.0;
  v_B_ = {surge, 0.0, 0.0};
}

void ExpectedMotion::set_velocity(const Vector3d& v_B) {
  reference_ = v_B.x();
  v_B_ = v_B;
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
  const double surge_thrust =
      efforts ? efforts->x() * m.full_speed * m.full_speed : thrust_for(propulsion.speed, dt);
  surge_thrust_ += gain * (surge_thrust - surge_thrust_);
  if (efforts) {
    reference_ = v_B_.x();
    heave_thrust_ += gain * (efforts->y() * m.full_heave * m.full_heave - heave_thrust_);
  }

  const double u = v_B_.x();
  const double v = v_B_.y();
  const double w = v_B_.z();
  const double p = omega_B.x();
  const double q = omega_B.y();
  const double r = omega_B.z();
  const double mu_y = m.sway_mass_ratio;
  const double mu_z = m.heave_mass_ratio;
  const double tail = std::copysign(m.tail_m, u);
  Vector3d rate;
  rate.x() = (surge_thrust_ - signed_square(u)) / m.coast_m.x() + v * r / mu_y - w * q / mu_z +
             m.buoyancy * up_B.x();
  rate.y() = w * p * mu_y / mu_z - mu_y * u * r - signed_square(v) / m.coast_m.y() -
             std::abs(u) * (v - r * tail) / m.tail_lift_m.x() + mu_y * m.buoyancy * up_B.y();
  rate.z() = mu_z * u * q - v * p * mu_z / mu_y;
  if (efforts) {
    rate.z() += (heave_thrust_ - signed_square(w)) / m.coast_m.z() -
                std::abs(u) * (w + q * tail) / m.tail_lift_m.y() + mu_z * m.buoyancy * up_B.z();
  }
  v_B_ += rate * dt;
}

void ExpectedMotion::correct(double height_rate, const Vector3d& up_B, double dt) {
  const Vector3d weighted = kVariances.cwiseProduct(up_B);
  const double gain = -std::expm1(-dt / kCorrection_s) / up_B.dot(weighted);
  v_B_ += gain * (height_rate - up_B.dot(v_B_)) * weighted;
}

}  // namespace dive::estimation
