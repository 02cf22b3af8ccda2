#include "estimation/vision_estimate.h"

#include <fmt/format.h>

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

std::string to_sentence(const TagSight& sight) {
  const std::string name = fmt::format("tag {}", sight.id);
  switch (sight.verdict) {
    case TagVerdict::kNone:
      return "no tag is seen";
    case TagVerdict::kUsed:
      return fmt::format("{}: the vehicle is {:.2f} m from where it was thought to be", name,
                         sight.off_m);
    case TagVerdict::kUnknown:
      return name + " is seen, but the mission knows none of that id";
    case TagVerdict::kTwice:
      return name + " is seen twice in one picture: neither is believed";
    case TagVerdict::kMisshapen:
      return name + " is seen, but misshapen";
    case TagVerdict::kAmbiguous:
      return name + " is seen, but leaves two places for the vehicle";
    case TagVerdict::kRefused:
      return fmt::format(
          "{} is not believed: by it the vehicle is {:.2f} m from where it can be; is the tag "
          "where "
          "the mission has it?",
          name, sight.off_m);
  }
  return "";
}

}  // namespace dive::estimation
