#pragma once
// The visual front end: features of the left camera tracked from image to image by ViSP's KLT
// tracker, and matched in the right one. The output for a filter is normalised coordinates under
// persistent ids, and the faults of the image.
//
// A feature is kept only if it
//   - is found from the gyro's prediction (infinite homography K R K^-1, and its last motion), and
//     from there back at its old position;
//   - obeys the epipolar constraint of the gyro's rotation and one common translation, since the
//     last image and since the sixteenth before, as far as the gyro's bias is known: drifting
//     marine snow becomes detectable in a second, not in one image.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"
#include "estimation/visual_inertial/front_end/gyro_turn.h"
#include "estimation/visual_inertial/front_end/image_quality.h"

namespace dive::estimation {

struct TrackerOptions {
  int max_features = 200;
  int window_px = 16;             ///< Window of KLT; a multiple of 8.
  int levels = 2;                 ///< Levels of KLT's pyramid above the image itself.
  double min_gradient = 6.0;      ///< Minimum of a corner, grey levels per pixel after equalising.
  double min_distance_px = 12.0;  ///< Distance of a new feature from all others.
  int cells_per_image = 8;        ///< Grid cells searched for new features.
  double back_px = 0.8;           ///< Maximum error of a point tracked forwards and back.
  double epipolar_px = 1.0;       ///< Tolerance since the last image.
  double drift_px = 1.5;          ///< Tolerance since the sixteenth before: noise adds up.
  double min_contrast = 3.0;      ///< Standard deviation, grey levels; below it is only noise.
  int min_features = 10;          ///< Fewer are a fault: moving ones cannot be detected.
  double max_gap_s = 0.5;         ///< Maximum gap over which features are tracked.
  double min_depth_m = 0.25;      ///< Minimum depth of a stereo match.

  /// A description of the first error; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
};

struct TrackedImage {
  FeatureFrame frame;  ///< Ids in increasing order; no features if the image was rejected.
  ImageQuality quality;
};

/// Equal options, cameras, seed and calls give bit-identical features on one machine.
class Tracker {
 public:
  static constexpr int kMinSide_px = 64;  ///< Minimum width and height of an image.

  /// Demands options and cameras that validate, of at least the minimum size; a right camera of the
  /// same size as the left one and apart from it. Only their relative pose is used.
  Tracker(TrackerOptions options, const CameraModel& left, const std::optional<CameraModel>& right,
          std::uint64_t seed);
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;
  ~Tracker();

  /// Stamp of the last used image, if any: the start of the next turn.
  [[nodiscard]] std::optional<Utime> utime() const;

  /// Processes the next image, and the right camera's, taken within a millisecond, if there is one.
  /// `turn`: the gyro's rotation of the left camera from utime() to now; without it there is no
  /// prediction and no check of motion. A rejected image changes nothing.
  /// Library exceptions do not leave it.
  [[nodiscard]] TrackedImage step(const ImageFrame& left, const ImageFrame* right,
                                  const std::optional<CameraTurn>& turn);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::estimation
