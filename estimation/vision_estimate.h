#pragma once
// What a visual-inertial estimator says of one pair of pictures.

#include <string>

#include "common/clock.h"
#include "estimation/state_estimate.h"

namespace dive::estimation {

/// Why it is not to be believed.
enum class VisionFault {
  kNone,
  kStarting,     ///< It has not begun yet.
  kNoPictures,   ///< None have come.
  kLate,         ///< What is said is of long ago.
  kBadPicture,   ///< Not as agreed, stamped wrongly, or a library failed on it.
  kFrozen,       ///< The same picture again.
  kDark,         ///< No contrast: dark, dazzled, nothing but water.
  kBlurred,      ///< Much less sharp than those before.
  kFewFeatures,  ///< Too few to be sure that they stand still.
  kLost,         ///< Nearly all that was followed is gone at once.
  kRefused,      ///< Features are seen, but the filter does not believe them.
  kDiverged,     ///< The filter says so of itself.
  kImplausible,  ///< It is none of a vehicle that swims here.
};

/// For people: "the cameras see nothing: it is dark, or there is only water".
[[nodiscard]] const char* to_sentence(VisionFault fault);

/// Places that were recognised, and what came of it.
struct ClosedLoops {
  int count = 0;            ///< Since the dive began; the rest is of the newest.
  Utime seen = 0;           ///< When its place was seen first, and ...
  Utime recognised = 0;     ///< ... again.
  double moved_m = 0.0;     ///< The estimate, horizontally, ...
  double turned_rad = 0.0;  ///< ... and its heading.
};

/// What became of a tag that was seen.
enum class TagVerdict {
  kNone,       ///< None was seen, or nothing that is news.
  kUsed,       ///< It has told where the vehicle is.
  kUnknown,    ///< The mission knows none of that id.
  kTwice,      ///< Two of that id in one picture.
  kMisshapen,  ///< Its corners are no square's: in part hidden, bent, blurred.
  kAmbiguous,  ///< The vehicle could be in either of two places.
  kRefused,  ///< It contradicts all else: it is not where the mission has it, or the vehicle is not
             ///< where it is thought to be.
};

struct TagSight {
  int id = -1;
  TagVerdict verdict = TagVerdict::kNone;
  double off_m = 0.0;  ///< How far off the estimate was by it, horizontally.
};

/// For people: "tag 3: the vehicle is 0.41 m from where it was thought to be".
[[nodiscard]] std::string to_sentence(const TagSight& sight);

struct VisionEstimate {
  Utime frame_utime = 0;   ///< When the pictures were taken.
  StateEstimate estimate;  ///< Soon after that, at its own utime.
  /// Of the published estimate that the filter began from. Another one: it was begun anew.
  Utime begun_from = 0;
  double period_s = 0.05;  ///< From one pair of pictures to the next, as they are to come.
  VisionFault fault = VisionFault::kStarting;
  int tracked = 0;    ///< Features known from before.
  int stereo = 0;     ///< Features seen by both cameras.
  int used = 0;       ///< Tracks and landmarks that corrected the filter.
  ClosedLoops loops;  ///< That have corrected `estimate` since.
  TagSight tag;       ///< The one that matters most.

  [[nodiscard]] bool is_good() const { return estimate.valid && fault == VisionFault::kNone; }
};

}  // namespace dive::estimation
