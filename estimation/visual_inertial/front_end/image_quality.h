#pragma once
// Quality of an image for tracking, and the faults that make it useless.

#include <string>

namespace dive::estimation {

/// Faults of an image. Only kNone, kFewFeatures and kLost give features.
enum class ImageFault {
  kNone,
  kNotAsAgreed,   ///< Unexpected size, format or number of pixels.
  kNotLater,      ///< Stamp equal to or before the last one.
  kFrozen,        ///< Equal to the last one, bit for bit: a static camera still has noise.
  kNoContrast,    ///< Dark, dazzled, or open water.
  kFewFeatures,   ///< Too few to detect moving ones; the estimator decides whether to use them.
  kLost,          ///< Nearly all features were lost at once; new ones follow.
  kLibraryError,  ///< ViSP or OpenCV threw an exception.
};

[[nodiscard]] const char* to_string(ImageFault fault);

/// Quality of one image, for monitoring the estimator.
struct ImageQuality {
  ImageFault fault = ImageFault::kNone;
  std::string reason;        ///< A sentence; empty without a fault.
  std::string right_reason;  ///< Reason why the right image was not used, if there was one.
  double brightness = 0.0;   ///< Mean, grey levels.
  double contrast = 0.0;     ///< Standard deviation, grey levels.
  double sharpness = 0.0;    ///< ImageStatistics::sharpness: falls with blur.
  int tracked = 0;           ///< Features tracked from the last image.
  int added = 0;             ///< New features.
  int stereo = 0;            ///< Tracked and new features matched in the right image.
  int lost = 0;              ///< Features not found, not found back, or outside the image.
  int moving = 0;            ///< Features rejected because of motion of their own.
};

}  // namespace dive::estimation
