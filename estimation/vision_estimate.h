#pragma once
// The visual-inertial estimate for one image pair.

#include <string>

#include "common/clock.h"
#include "estimation/state_estimate.h"

namespace dive::estimation {

/// Reasons to reject it.
enum class VisionFault {
  kNone,
  kStarting,     ///< Not initialised yet.
  kNoImages,     ///< No images have arrived.
  kLate,         ///< The estimate is too old.
  kBadImage,     ///< Unexpected format or stamp, or a library failed.
  kFrozen,       ///< The same image again.
  kDark,         ///< No contrast: dark, dazzled, or only water.
  kBlurred,      ///< Much less sharp than earlier images.
  kFewFeatures,  ///< Too few features to detect moving ones.
  kLost,         ///< Nearly all tracked features were lost at once.
  kRefused,      ///< The filter rejects the observed features.
  kDiverged,     ///< The filter reports divergence.
  kImplausible,  ///< The estimate is implausible for this vehicle.
};
inline constexpr VisionFault kLastVisionFault = VisionFault::kImplausible;

/// A clause about the estimator, such as "the images are blurred".
[[nodiscard]] const char* to_sentence(VisionFault fault);

/// Recognised places and their effect.
struct ClosedLoops {
  int count = 0;  ///< Number since the dive began; the other members describe the newest.
  Utime first_observed = 0;  ///< Time of the first observation of the place.
  Utime recognised = 0;      ///< Time of the second observation of the place.
  double moved_m = 0.0;      ///< Horizontal correction of the estimate.
  double turned_rad = 0.0;   ///< Correction of the heading.
};

/// Result of observing a tag.
enum class TagResult {
  kNone,       ///< No tag observed, or no new information.
  kUsed,       ///< The tag gave a position fix.
  kUnknown,    ///< The mission has no tag of that id.
  kTwice,      ///< Two tags of that id in one image.
  kMisshapen,  ///< The corners are not a square's: partly hidden, bent, blurred.
  kAmbiguous,  ///< Two vehicle poses are possible.
  kRefused,    ///< It contradicts all other data: the tag is not where the mission puts it, or the
               ///< vehicle's estimate is wrong.
};
inline constexpr TagResult kLastTagResult = TagResult::kRefused;

struct TagObservation {
  int id = -1;
  TagResult result = TagResult::kNone;
  double correction_m = 0.0;  ///< Horizontal position error of the estimate by the tag.
};

/// A sentence, such as "tag 3: corrects the vehicle's position by 0.41 m".
[[nodiscard]] std::string to_sentence(const TagObservation& observation);

struct VisionEstimate {
  Utime frame_utime = 0;   ///< Time of the images.
  StateEstimate estimate;  ///< Estimate shortly after the images, at its own utime.
  /// Time of the published estimate that initialised the filter, or of that start. A new value
  /// means re-initialisation.
  Utime init_utime = 0;
  double period_s = 0.05;  ///< Expected period of the image pairs.
  VisionFault fault = VisionFault::kStarting;
  int tracked = 0;     ///< Number of features tracked from earlier images.
  int stereo = 0;      ///< Number of features observed by both cameras.
  int used = 0;        ///< Number of tracks and landmarks that updated the filter.
  ClosedLoops loops;   ///< Loop closures contained in `estimate`.
  TagObservation tag;  ///< The most relevant tag.

  [[nodiscard]] bool is_good() const { return estimate.valid && fault == VisionFault::kNone; }
};

}  // namespace dive::estimation
