#include "estimation/dataset/run_health.h"

namespace dive::estimation {
namespace {

void add_image(VisionFault fault, const ImageQuality& quality, ImageFaults& images) {
  if (!quality.right_reason.empty()) ++images.right_unused;
  if (fault == VisionFault::kNone) return;
  images.last = quality.reason.empty() ? to_sentence(fault) : quality.reason;
  ++(fault == VisionFault::kFrozen        ? images.frozen
     : fault == VisionFault::kDark        ? images.dark
     : fault == VisionFault::kBlurred     ? images.blurred
     : fault == VisionFault::kFewFeatures ? images.few_features
     : fault == VisionFault::kLost        ? images.lost
                                          : images.bad);
}

}  // namespace

bool RunHealth::add(const VisionPipeline& pipeline, const VisionEstimate& vision,
                    const FeedStep& step) {
  const FilterHealth& filter = pipeline.health();
  inputs = filter.faults;
  features_used = filter.features_used;
  if (!filter.suspicion.empty()) suspicion = filter.suspicion;
  if (pipeline.restarted()) {
    restarts.push_back(*pipeline.restarted());
    if (restarts.back().has_failed) failure = restarts.back().reason;
  }
  if (filter.diverged) failure = "the filter has diverged: " + filter.reason;
  if (vision.is_good()) failure.clear();
  if (!step.has_image) return false;
  if (!step.right_error.empty()) ++images.right_unused;
  if (step.left_error.empty()) {
    add_image(pipeline.image_fault(), pipeline.image_quality(), images);
  } else {
    ++images.bad;
    images.last = step.left_error;
  }
  const StateEstimate& estimate = vision.estimate;
  if (filter.diverged || !estimate.valid || estimate.utime <= newest) {
    ++(filter.diverged ? diverged : !estimate.valid ? starting : late);
    return false;
  }
  newest = estimate.utime;
  if (vision.is_good()) ++trusted;
  if (vision.fault == VisionFault::kRefused) ++refused;
  return true;
}

}  // namespace dive::estimation
