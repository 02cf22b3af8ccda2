#include "behaviors/surface.h"

#include <algorithm>

namespace dive::behaviors {

Surface::Surface(SurfaceOptions options) : options_(options) { progress_.leg = "surface"; }

BehaviorOutput Surface::step(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  const double depth = -X_WB.p.z();
  if (!entered_at_) {
    entered_at_ = input.now;
    entry_depth_ = depth;
    yaw_ = to_rpy(X_WB.q).z();
  }
  const double risen = options_.ascent_rate * to_seconds(input.now - *entered_at_);
  BehaviorOutput output;
  output.command = station_keeping(std::max(entry_depth_ - risen, 0.0), yaw_);
  output.done = depth < options_.surfaced_depth;
  progress_.distance_to_go_m = std::max(depth, 0.0);
  return output;
}

}  // namespace dive::behaviors
