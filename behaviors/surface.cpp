#include "behaviors/surface.h"

#include <algorithm>

namespace dive::behaviors {
namespace {

constexpr double kAboveSurface = -1.0;     // m of depth, to be pushed against
constexpr double kPatience = 2.0;          // times the ascent it should take ...
constexpr double kPatienceSeconds = 10.0;  // ... and so long besides

}  // namespace

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
  if (!input.depth_known) {  // up, whatever the estimate believes, for long enough to be true
    output.command = station_keeping(kAboveSurface, yaw_);
    const double needed = kPatience * entry_depth_ / options_.ascent_rate + kPatienceSeconds;
    output.done = to_seconds(input.now - *entered_at_) > needed;
  }
  progress_.distance_to_go_m = std::max(depth, 0.0);
  return output;
}

}  // namespace dive::behaviors
