#pragma once
// Pictures to loops: what a keyframe shows, and whether it shows a place that was seen before.

#include <optional>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/keyframe.h"
#include "estimation/visual_inertial/loop_closer.h"

namespace dive::estimation {

struct Keyframe {
  ImageFrame left;
  ImageFrame right;
  StateEstimate filter;  ///< Of the moment of the pictures, without any correction.
  Pose X_BL;             ///< The cameras as the filter has calibrated them.
  Pose X_BR;
  Utime begun_from = 0;  ///< VisionEstimate
};

/// Runs on a worker. Same calls, same results.
class LoopFinder {
 public:
  /// Demands options and cameras that validate.
  LoopFinder(const LoopCloserOptions& options, const CameraModel& left, const CameraModel& right);

  /// What comes back replaces the correction of the filter that was applied until now. Pictures not
  /// as agreed are no keyframe. Nothing leads from one beginning of the filter to the next: what
  /// was seen before is forgotten.
  [[nodiscard]] std::optional<LoopCorrection> look(const Keyframe& keyframe);

  [[nodiscard]] const LoopReport& report() const { return closer_.report(); }

 private:
  PlaceViewer viewer_;
  LoopCloser closer_;
  std::optional<Utime> begun_from_;
};

}  // namespace dive::estimation
