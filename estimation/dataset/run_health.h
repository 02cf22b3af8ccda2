#pragma once
// What the checks of a dive found in a run of the visual-inertial estimator on a recording.

#include <string>
#include <vector>

#include "estimation/dataset/recording_feed.h"
#include "estimation/visual_inertial/filter/filter_health.h"
#include "estimation/visual_inertial/pipeline/vision_pipeline.h"

namespace dive::estimation {

/// Number of images by fault; an image has at most one. Of blurred ones and those with few features
/// or lost ones the features are used still.
struct ImageFaults {
  int bad = 0;           ///< Not readable, unexpected format or stamp, or a library failed.
  int frozen = 0;        ///< The same image again.
  int dark = 0;          ///< No contrast.
  int blurred = 0;       ///< Much less sharp than usual.
  int few_features = 0;  ///< Too few features to detect moving ones.
  int lost = 0;          ///< Nearly all features were lost at once.
  int right_unused = 0;  ///< Right images that were not used.
  std::string last;      ///< The last fault as a sentence; empty if there was none.

  /// Without features.
  [[nodiscard]] int rejected() const { return bad + frozen + dark; }
};

struct RunHealth {
  ImageFaults images;
  int trusted = 0;   ///< Estimates that a dive uses.
  int starting = 0;  ///< Images for which the filter had not begun.
  int refused = 0;  ///< Estimates while visual and inertial measurements disagreed, or soon after a
                    ///< failure.
  int diverged = 0;       ///< Images for which the filter had diverged.
  int late = 0;           ///< Images without newer IMU samples: there is no new estimate.
  std::string suspicion;  ///< The filter's last suspicion, a sentence; empty if there was none.
  InputFaults inputs;     ///< Measurements that the filter rejected.
  std::int64_t features_used = 0;
  std::vector<VisionRestart> restarts;
  /// Why the filter has failed, a clause; empty if it has not, or an estimate was trusted since.
  std::string failure;

  Utime newest = 0;  ///< Time of the newest estimate.

  /// Adds a step of the pipeline, and its result; true if that is a new estimate for its image.
  bool add(const VisionPipeline& pipeline, const VisionEstimate& vision, const FeedStep& step);
};

}  // namespace dive::estimation
