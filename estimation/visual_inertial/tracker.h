#pragma once
// The visual front end: features of the left camera followed from picture to picture by ViSP's KLT
// tracker, and found again in the right one. What comes out is for a filter: normalised coordinates
// under ids that last, and what was wrong with the picture.
//
// A feature is kept only if it
//   - is found from where the gyro says it went (infinite homography K R K^-1, and on as it moved
//     last), and from there back to where it was;
//   - obeys the epipolar constraint of the gyro's rotation and one translation for all, since the
//     last picture and since the sixteenth before: snow that drifts with the water betrays itself
//     in a second, not in one picture.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "estimation/visual_inertial/feature_frame.h"

namespace dive::estimation {

struct TrackerOptions {
  int max_features = 200;
  int window_px = 16;             ///< Of KLT; a multiple of 8.
  int levels = 2;                 ///< Of KLT's pyramid, above the picture itself.
  double min_gradient = 6.0;      ///< Of a corner, grey levels per pixel after evening out.
  double min_distance_px = 12.0;  ///< Of a new feature from all others.
  int cells_per_picture = 8;      ///< Of the grid, searched for new features.
  double back_px = 0.8;           ///< Forwards and backwards, a point returns so near.
  double epipolar_px = 1.0;       ///< Since the last picture.
  double drift_px = 1.5;          ///< Since the sixteenth picture before: gyro errors add up.
  double min_contrast = 3.0;      ///< Standard deviation, grey levels; below that it is noise.
  int min_features = 10;          ///< Fewer are a fault: who can tell what stands still from snow?
  double max_gap_s = 0.5;         ///< Features are not followed over longer gaps.
  double min_depth_m = 0.25;      ///< Nearer points are not matched in stereo.

  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
};

/// What is wrong with a picture. None but kNone, kFewFeatures and kLost gives features.
enum class PictureFault {
  kNone,
  kNotAsAgreed,   ///< Size, format or number of pixels.
  kNotLater,      ///< Stamped like the last one or before it.
  kFrozen,        ///< Bit for bit the last one: a camera that stands still has noise.
  kNoContrast,    ///< Dark, dazzled, or nothing but water.
  kFewFeatures,   ///< Too few to be sure that they stand still; whether to believe them is the
                  ///< estimator's to say.
  kLost,          ///< Nearly all features are gone at once; those that come are new.
  kLibraryError,  ///< ViSP or OpenCV threw.
};

[[nodiscard]] const char* to_string(PictureFault fault);

/// Of one picture, for those who watch over the estimator's health.
struct PictureQuality {
  PictureFault fault = PictureFault::kNone;
  std::string reason;        ///< A sentence; empty without a fault.
  std::string right_reason;  ///< Why the right picture was not used, though there was one.
  double brightness = 0.0;   ///< Mean, grey levels.
  double contrast = 0.0;     ///< Standard deviation, grey levels.
  double sharpness = 0.0;    ///< PictureStatistics::sharpness: falls as the picture blurs.
  int tracked = 0;           ///< Features known from before.
  int added = 0;             ///< New ones.
  int stereo = 0;            ///< Of both, seen by the right camera as well.
  int lost = 0;              ///< Not found, not found back, or gone out of the picture.
  int moving = 0;            ///< Thrown out because they move on their own.
};

struct TrackedPicture {
  FeatureFrame frame;  ///< Ids in rising order; no features where the picture was refused.
  PictureQuality quality;
};

/// Same options, cameras and seed, same calls: the same features, bit for bit, on one machine.
class Tracker {
 public:
  /// Demands options and cameras that validate; a right camera of the same size as the left one
  /// and apart from it. Poses are used between the two only.
  Tracker(TrackerOptions options, const CameraModel& left, const std::optional<CameraModel>& right,
          std::uint64_t seed);
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;
  ~Tracker();

  /// Stamp of the last picture that was used, if there was one: what q_C1C0 has to start from.
  [[nodiscard]] std::optional<Utime> utime() const;

  /// The next picture, and that of the right camera, taken within a millisecond, if there is one.
  /// `q_C1C0`: by the gyro, of the left camera at utime() in that of now (p_C1 = q_C1C0 p_C0);
  /// without it nothing is predicted and no motion checked. A picture that is refused changes
  /// nothing. Never throws what a library throws.
  [[nodiscard]] TrackedPicture step(const ImageFrame& left, const ImageFrame* right,
                                    const std::optional<Eigen::Quaterniond>& q_C1C0);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::estimation
