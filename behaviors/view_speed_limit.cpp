#include "behaviors/view_speed_limit.h"

#include <algorithm>
#include <cmath>

namespace dive::behaviors {
namespace {

constexpr double kViewTimeout = 12.0;          // s of a wait without progress
constexpr double kProgress = 1.0;              // m that count as progress
constexpr double kElsewhere = 0.8;             // rad: a change of heading that restarts the wait
constexpr double kSlack = 0.015;               // m/s: a smaller difference of speed is ignored
constexpr double kPush = 2.0;                  // gain on the difference of speed
constexpr double kMaxDriftCompensation = 0.3;  // m/s: bound of the compensation, as is the command
constexpr double kSharp = 0.4;                 // rad still to turn: a sharp turn
constexpr double kTurnSpeed = 0.06;            // m/s: bound of the forward speed in a sharp turn
constexpr double kAllButStopped = 0.12;        // m/s: speed below which a sharp turn may start

}  // namespace

void ViewSpeedLimit::apply(Utime now, Utime behavior_now, const estimation::StateEstimate& estimate,
                           vehicle::Command& command) {
  const Eigen::Vector3d& p_W = estimate.X_WB.p;
  const double most = ahead_.max_command(now, estimate.v_WB_B.x());
  command.v = std::min(command.v, most);
  const double yaw = to_rpy(command.o).z();
  const bool got_on = waiting_ && (p_W - waiting_->p_W).norm() > kProgress;
  if (got_on || (waiting_ && std::abs(wrap_angle(yaw - waiting_->yaw)) > kElsewhere)) {
    waiting_.reset();
  }
  if (most > 0.0) {
    blocked_depth_.reset();
    return;
  }
  if (!blocked_depth_) blocked_depth_ = std::max(-p_W.z(), 0.0);
  if (!waiting_) waiting_ = Waiting{behavior_now, p_W, yaw};
  command.d = std::max(command.d, *blocked_depth_);
}

bool ViewSpeedLimit::view_timed_out(Utime behavior_now) {
  if (!waiting_ || !blocked_depth_) return false;
  if (to_seconds(behavior_now - waiting_->since) < kViewTimeout) return false;
  waiting_.reset();
  return true;
}

void hold_speed(double surge, vehicle::Command& command) {
  const double missing = command.v - surge;
  if (std::abs(missing) < kSlack) return;
  const double most = std::max(std::abs(command.v), kMaxDriftCompensation);
  command.v = std::clamp(command.v + kPush * missing, -most, most);
}

void compensate_drift(double surge, double yaw, vehicle::Command& command) {
  const Eigen::Vector3d wanted = to_rpy(command.o);
  const bool turns = std::abs(wrap_angle(wanted.z() - yaw)) > kSharp;
  if (turns) {
    command.v = std::clamp(command.v, -kTurnSpeed, kTurnSpeed);
    if (std::abs(surge) > kAllButStopped) command.o = from_rpy(wanted.x(), wanted.y(), yaw);
  }
  const bool speeds_up = (command.v - surge) * surge >= 0.0;
  if (!speeds_up || !turns) hold_speed(surge, command);
}

}  // namespace dive::behaviors
