#include "vehicle/predicted_attitude.h"

#include <algorithm>
#include <cmath>

#include "common/se3.h"
#include "vehicle/autopilot.h"

namespace dive::vehicle {

void PredictedAttitude::start(const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& omega_B) {
  q_WB_ = q_WB.normalized();
  omega_B_ = omega_B;
  age_s_ = 0.0;
}

void PredictedAttitude::advance(const PseudoRates& rates, double dt) {
  age_s_ += dt;
  static const AutopilotOptions aqua2;
  const Eigen::Vector3d up_B = q_WB_.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d effort =
      Eigen::Vector3d(rates.roll, rates.pitch, rates.yaw) - righting_effort(aqua2, up_B);
  const Eigen::Vector3d drag =
      Eigen::Vector3d(kDrag).cwiseProduct(omega_B_.cwiseAbs().cwiseProduct(omega_B_));
  omega_B_ += dt * (Eigen::Vector3d(kGain).cwiseProduct(effort) - drag);
  q_WB_ = (q_WB_ * so3_exp(dt * omega_B_)).normalized();
}

double PredictedAttitude::tilt() const {
  return std::acos(std::clamp((q_WB_ * Eigen::Vector3d::UnitZ()).z(), -1.0, 1.0));
}

}  // namespace dive::vehicle
