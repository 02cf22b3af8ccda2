#include "estimation/visual_inertial/loop_closure/loop_finder.h"

#include <utility>

namespace dive::estimation {

LoopFinder::LoopFinder(const LoopCloserOptions& options, const CameraModel& left,
                       const CameraModel& right)
    : viewer_({}, left, right), closer_(options, left, right) {}

bool LoopFinder::is_due(const StateEstimate& filter, Utime init_utime) const {
  return init_utime_ != init_utime || closer_.is_due(filter);
}

std::optional<LoopCorrection> LoopFinder::process(const Keyframe& keyframe) {
  if (init_utime_ != keyframe.init_utime) {
    closer_.restart();
    init_utime_ = keyframe.init_utime;
  }
  if (!closer_.is_due(keyframe.filter)) return std::nullopt;
  auto view = viewer_.view(keyframe.left, keyframe.right);
  if (!view) return std::nullopt;
  closer_.calibrate(keyframe.X_BL, keyframe.X_BR);
  return closer_.add(std::move(*view), keyframe.filter);
}

}  // namespace dive::estimation
