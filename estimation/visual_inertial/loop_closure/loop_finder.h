#pragma once
// From images to loops: the view of a keyframe, and recognition of a place observed before.

#include <optional>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/loop_closure/keyframe.h"
#include "estimation/visual_inertial/loop_closure/loop_closer.h"

namespace dive::estimation {

struct Keyframe {
  ImageFrame left;
  ImageFrame right;
  StateEstimate filter;  ///< Estimate at the time of the images, without any correction.
  Pose X_BL;             ///< Camera poses as calibrated by the filter.
  Pose X_BR;
  Utime init_utime = 0;  ///< VisionEstimate
};

/// Runs on a worker. Deterministic.
class LoopFinder {
 public:
  /// Demands options and cameras that validate.
  LoopFinder(const LoopCloserOptions& options, const CameraModel& left, const CameraModel& right);

  /// True if a keyframe with this estimate is due; VisionEstimate::init_utime.
  [[nodiscard]] bool is_due(const StateEstimate& filter, Utime init_utime) const;

  /// The result replaces the correction of the filter applied so far. Unexpected images give no
  /// keyframe. Nothing connects two initialisations of the filter: a new one drops all earlier
  /// keyframes.
  [[nodiscard]] std::optional<LoopCorrection> process(const Keyframe& keyframe);

  [[nodiscard]] const LoopReport& report() const { return closer_.report(); }

 private:
  KeyframeExtractor viewer_;
  LoopCloser closer_;
  std::optional<Utime> init_utime_;
};

}  // namespace dive::estimation
