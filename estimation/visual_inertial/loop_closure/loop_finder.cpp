#include "estimation/visual_inertial/loop_closure/loop_finder.h"

#include <utility>

namespace dive::estimation {

LoopFinder::LoopFinder(const LoopCloserOptions& options, const CameraModel& left,
                       const CameraModel& right)
    : viewer_({}, left, right), closer_(options, left, right) {}

std::optional<LoopCorrection> LoopFinder::look(const Keyframe& keyframe) {
  if (begun_from_ != keyframe.begun_from) {
    closer_.restart();
    begun_from_ = keyframe.begun_from;
  }
  if (!closer_.is_due(keyframe.filter)) return std::nullopt;
  auto view = viewer_.view(keyframe.left, keyframe.right);
  if (!view) return std::nullopt;
  closer_.calibrate(keyframe.X_BL, keyframe.X_BR);
  return closer_.add(std::move(*view), keyframe.filter);
}

}  // namespace dive::estimation
