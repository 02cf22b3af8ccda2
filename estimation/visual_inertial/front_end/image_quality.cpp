#include "estimation/visual_inertial/front_end/image_quality.h"

namespace dive::estimation {

const char* to_string(ImageFault fault) {
  switch (fault) {
    case ImageFault::kNone:
      return "none";
    case ImageFault::kNotAsAgreed:
      return "not_as_agreed";
    case ImageFault::kNotLater:
      return "not_later";
    case ImageFault::kFrozen:
      return "frozen";
    case ImageFault::kNoContrast:
      return "no_contrast";
    case ImageFault::kFewFeatures:
      return "few_features";
    case ImageFault::kLost:
      return "lost";
    case ImageFault::kLibraryError:
      return "library_error";
  }
  return "?";
}

}  // namespace dive::estimation
