#include "behaviors/hold.h"

#include <algorithm>

#include "common/assert.h"

namespace dive::behaviors {

Hold::Hold(double duration_s) : duration_s_(duration_s) { DIVE_DEMAND(duration_s >= 0.0); }

BehaviorOutput Hold::step(const BehaviorInput& input) {
  if (!entered_at_) {
    entered_at_ = input.now;
    const Pose& X_WB = input.estimate->X_WB;
    station_ = station_keeping(std::max(-X_WB.p.z(), 0.0), to_rpy(X_WB.q).z());
  }
  BehaviorOutput output;
  output.command = station_;
  output.done = to_seconds(input.now - *entered_at_) >= duration_s_;
  return output;
}

}  // namespace dive::behaviors
