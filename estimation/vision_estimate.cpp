#include "estimation/vision_estimate.h"

#include <fmt/format.h>

namespace dive::estimation {

const char* to_sentence(VisionFault fault) {
  switch (fault) {
    case VisionFault::kNone:
      return "the visual-inertial estimates are good";
    case VisionFault::kStarting:
      return "the visual-inertial estimator is not initialised yet";
    case VisionFault::kNoImages:
      return "no images arrive";
    case VisionFault::kLate:
      return "the visual-inertial estimates are too old";
    case VisionFault::kBadImage:
      return "an image has an unexpected format or stamp, or a library failed";
    case VisionFault::kFrozen:
      return "the same image arrives again and again";
    case VisionFault::kDark:
      return "the images have no contrast: it is dark, or there is only water";
    case VisionFault::kBlurred:
      return "the images are blurred";
    case VisionFault::kFewFeatures:
      return "there are too few features";
    case VisionFault::kLost:
      return "nearly all features were lost at once";
    case VisionFault::kRefused:
      return "visual and inertial measurements disagree";
    case VisionFault::kDiverged:
      return "the visual-inertial filter has diverged";
    case VisionFault::kImplausible:
      return "the visual-inertial estimate is implausible for this vehicle";
  }
  return "";
}

std::string to_sentence(const TagObservation& observation) {
  const std::string name = fmt::format("tag {}", observation.id);
  switch (observation.result) {
    case TagResult::kNone:
      return "no tag is observed";
    case TagResult::kUsed:
      return fmt::format("{}: corrects the vehicle's position by {:.2f} m", name,
                         observation.correction_m);
    case TagResult::kUnknown:
      return name + " is observed, but the mission has no tag of that id";
    case TagResult::kTwice:
      return name + " is observed twice in one image: both are rejected";
    case TagResult::kMisshapen:
      return name + " is observed, but its corners are not a square's";
    case TagResult::kAmbiguous:
      return name + " is observed, but two poses of the vehicle are possible";
    case TagResult::kRefused:
      return fmt::format(
          "{} is rejected: it would correct the vehicle's position by {:.2f} m, more than all "
          "other "
          "data allow; check its position in the mission",
          name, observation.correction_m);
  }
  return "";
}

}  // namespace dive::estimation
