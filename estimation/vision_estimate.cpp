#include "estimation/vision_estimate.h"

namespace dive::estimation {

const char* to_sentence(VisionFault fault) {
  switch (fault) {
    case VisionFault::kNone:
      return "the cameras see well";
    case VisionFault::kStarting:
      return "the cameras' estimator has not begun yet";
    case VisionFault::kNoPictures:
      return "no pictures come";
    case VisionFault::kLate:
      return "the cameras' estimator answers too late";
    case VisionFault::kBadPicture:
      return "the pictures are not as agreed";
    case VisionFault::kFrozen:
      return "the same picture comes again and again";
    case VisionFault::kDark:
      return "the cameras see nothing: it is dark, or there is only water";
    case VisionFault::kBlurred:
      return "the pictures are blurred";
    case VisionFault::kFewFeatures:
      return "there is too little to be seen";
    case VisionFault::kLost:
      return "what was followed is gone all at once";
    case VisionFault::kRefused:
      return "what is seen does not fit what is felt";
    case VisionFault::kDiverged:
      return "the cameras' estimator has diverged";
    case VisionFault::kImplausible:
      return "the cameras' estimate is none of this vehicle";
  }
  return "";
}

}  // namespace dive::estimation
