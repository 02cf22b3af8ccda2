#include "vehicle/own_autopilot.h"

#include <utility>

namespace dive::vehicle {

void OwnAutopilot::observe(const std::optional<ImuSample>& imu,
                           const std::optional<DepthSample>& depth) {
  if (imu) imu_ = imu;
  if (depth) depth_ = depth;
}

void OwnAutopilot::release(Utime now) {
  steers_ = false;
  rates_ = {};
  last_ = now;
}

PseudoRates OwnAutopilot::step(const Command& command, double surge, Utime now) {
  const double dt = to_seconds(now - std::exchange(last_, now).value_or(now));
  if (!imu_ || !depth_ || dt <= 0.0) return rates_;
  // A reference that differs from the speed would brake past rest.
  if (!steers_ || command.v == 0.0) autopilot_.begin_at(surge);
  steers_ = true;
  rates_ = autopilot_.step(command, imu_->q_WB, imu_->gyro_B, depth_->depth_m, dt);
  return rates_;
}

}  // namespace dive::vehicle
