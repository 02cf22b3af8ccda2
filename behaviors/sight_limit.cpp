#include "behaviors/sight_limit.h"

#include <algorithm>

namespace dive::behaviors {
namespace {

constexpr double kPatience = 12.0;    // s without getting on ...
constexpr double kGotOn = 1.0;        // ... which is m
constexpr double kSlack = 0.03;       // m/s; less is let be, more is braked by a command ...
constexpr double kBraking = 2.0;      // ... that is so many times as large ...
constexpr double kMostBraking = 0.3;  // ... and no larger than this, m/s

}  // namespace

void SightLimit::apply(Utime now, Utime leaf_now, const estimation::StateEstimate& estimate,
                       vehicle::Command& command) {
  const Eigen::Vector3d& p_W = estimate.X_WB.p;
  const double most = ahead_.max_command(now, estimate.v_WB_B.x());
  command.v = std::min(command.v, most);
  if (waiting_ && (p_W - waiting_->p_W).norm() > kGotOn) waiting_.reset();
  if (most > 0.0) {
    blocked_depth_.reset();
    return;
  }
  if (!blocked_depth_) blocked_depth_ = std::max(-p_W.z(), 0.0);
  if (!waiting_) waiting_ = Waiting{leaf_now, p_W};
  command.d = std::max(command.d, *blocked_depth_);
}

bool SightLimit::waits_in_vain(Utime leaf_now) {
  if (!waiting_ || !blocked_depth_) return false;
  if (to_seconds(leaf_now - waiting_->since) < kPatience) return false;
  waiting_.reset();
  return true;
}

void brake(double surge, vehicle::Command& command) {
  const double excess = surge - command.v;
  const bool is_too_fast = surge > 0.0 ? excess > kSlack : excess < -kSlack;
  if (!is_too_fast) return;
  command.v = std::clamp(command.v - kBraking * excess, -kMostBraking, kMostBraking);
}

}  // namespace dive::behaviors
