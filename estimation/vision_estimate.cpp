#include "estimation/vision_estimate.h"

#include <fmt/format.h>

namespace dive::estimation {

const char* to_sentence(VisionFault fault) {
  switch (fault) {
    case VisionFault::kNone:
      return "the cameras see well";
    case VisionFault::kStarting:
      return "the cameras' estimator has not begun yet";
    case VisionFault::kNoImages:
      return "no pictures come";
    case VisionFault::kLate:
      return "the cameras' estimator answers too late";
    case VisionFault::kBadImage:
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
      return "visual and inertial measurements disagree";
    case VisionFault::kDiverged:
      return "the cameras' estimator has diverged";
    case VisionFault::kImplausible:
      return "the visual-inertial estimate is implausible for this vehicle";
  }
  return "";
}

std::string to_sentence(const TagObservation& observation) {
  const std::string name = fmt::format("tag {}", observation.id);
  switch (observation.result) {
    case TagResult::kNone:
      return "no tag is seen";
    case TagResult::kUsed:
      return fmt::format("{}: the vehicle is {:.2f} m from where it was thought to be", name,
                         observation.correction_m);
    case TagResult::kUnknown:
      return name + " is seen, but the mission knows none of that id";
    case TagResult::kTwice:
      return name + " is seen twice in one picture: neither is believed";
    case TagResult::kMisshapen:
      return name + " is seen, but misshapen";
    case TagResult::kAmbiguous:
      return name + " is seen, but leaves two places for the vehicle";
    case TagResult::kRefused:
      return fmt::format(
          "{} is not believed: by it the vehicle is {:.2f} m from where it can be; is the tag "
          "where "
          "the mission has it?",
          name, observation.correction_m);
  }
  return "";
}

}  // namespace dive::estimation
