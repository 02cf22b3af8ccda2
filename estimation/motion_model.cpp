#include "estimation/motion_model.h"

#include <algorithm>
#include <cmath>

#include "common/range_check.h"

namespace dive::estimation {
namespace {

double signed_square(double x) { return std::abs(x) * x; }

}  // namespace

std::string MotionModel::validate() const {
  RangeCheck check;
  check("speed_time_constant_s", speed_time_constant_s, 0.05, 60.0);
  check("full_speed", full_speed, 0.05, 5.0);
  check("thrust_lag_s", thrust_lag_s, 0.0, 10.0);
  check("surge_coast_m", surge_coast_m, 0.1, 100.0);
  check("sway_coast_m", sway_coast_m, 0.1, 100.0);
  check("tail_lift_m", tail_lift_m, 0.1, 1e6);
  check("tail_m", tail_m, 0.0, 10.0);
  check("mass_ratio", mass_ratio, 0.1, 10.0);
  return check.problem();
}

void ExpectedMotion::begin_at(double surge) {
  reference_ = surge_ = surge;
  thrust_ = signed_square(surge);
  sway_ = 0.0;
}

void ExpectedMotion::advance(double speed, double yaw_rate, double dt) {
  const MotionModel& m = model_;
  const double most = m.full_speed * m.full_speed;
  if (speed == 0.0) reference_ = surge_;
  const double drag = signed_square(reference_);
  const double wanted = (speed - reference_) / m.speed_time_constant_s;
  const double effort = std::clamp(drag + m.surge_coast_m * wanted, -most, most);
  reference_ += (effort - drag) / m.surge_coast_m * dt;
  thrust_ += (effort - thrust_) * (1.0 - std::exp(-dt / std::max(m.thrust_lag_s, 1e-9)));

  const double surge_rate =
      (thrust_ - signed_square(surge_)) / m.surge_coast_m + sway_ * yaw_rate / m.mass_ratio;
  const double sway_rate =
      -m.mass_ratio * surge_ * yaw_rate - signed_square(sway_) / m.sway_coast_m -
      (std::abs(surge_) * sway_ - surge_ * m.tail_m * yaw_rate) / m.tail_lift_m;
  surge_ += surge_rate * dt;
  sway_ += sway_rate * dt;
}

}  // namespace dive::estimation
