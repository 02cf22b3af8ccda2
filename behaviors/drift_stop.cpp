#include "behaviors/drift_stop.h"

#include <cmath>

#include "common/se3.h"

namespace dive::behaviors {
namespace {

constexpr double kSlip = 0.02;  // m/s sideways that is not worth a turn

}  // namespace

double DriftStop::heading(const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& v_B) {
  const double yaw = to_rpy(q_WB).z();
  if (!yaw_) yaw_ = yaw;
  const Eigen::Vector3d v_W = q_WB * v_B;
  double turn = wrap_angle(std::atan2(v_W.y(), v_W.x()) - yaw);
  if (std::abs(turn) > 0.5 * M_PI) turn = wrap_angle(turn + M_PI);  // stern ahead
  const double slip = v_W.head<2>().norm() * std::abs(std::sin(turn));
  if (slip > kSlip) yaw_ = wrap_angle(yaw + turn);
  return *yaw_;
}

}  // namespace dive::behaviors
