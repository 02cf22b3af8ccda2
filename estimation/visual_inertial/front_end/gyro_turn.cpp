#include "estimation/visual_inertial/front_end/gyro_turn.h"

#include <algorithm>
#include <iterator>

#include "common/se3.h"

namespace dive::estimation {

CameraTurn turn_by_gyro(std::span<const ImuSample> samples, Utime from, Utime to,
                        const GyroBias& bias, const Eigen::Quaterniond& q_BC) {
  auto it = std::upper_bound(samples.begin(), samples.end(), from,
                             [](Utime t, const ImuSample& s) { return t < s.utime; });
  if (it != samples.begin()) --it;
  Eigen::Quaterniond q_B0B1 = Eigen::Quaterniond::Identity();
  for (; it != samples.end() && it->utime < to; ++it) {
    const Utime end = std::next(it) == samples.end() ? to : std::min(to, std::next(it)->utime);
    const double dt = to_seconds(end - std::max(from, it->utime));
    if (dt > 0.0) q_B0B1 = q_B0B1 * so3_exp(dt * (it->gyro_B - bias.value));
  }
  const Eigen::Quaterniond q_B1B0 = q_B0B1.conjugate().normalized();
  return {(q_BC.conjugate() * q_B1B0 * q_BC).normalized(), bias.sigma * to_seconds(to - from)};
}

}  // namespace dive::estimation
