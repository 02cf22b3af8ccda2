#pragma once
// Positions of the tracks in the right camera's image. Internal.

#include <cstddef>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "estimation/visual_inertial/front_end/equalised_image.h"
#include "estimation/visual_inertial/front_end/stereo.h"
#include "estimation/visual_inertial/front_end/track.h"

namespace dive::estimation {

class TrackStereo {
 public:
  /// `min_contrast`: least standard deviation of the right image, grey levels.
  TrackStereo(const StereoOptions& options, const CameraModel& left, const CameraModel& right,
              int window_px, double min_contrast);

  /// Matches the tracks of the left image, number `image` and stamped `left_utime`. Returns the
  /// reason why the right image is not used; empty if it is.
  [[nodiscard]] std::string match(const EqualisedImage& left, Utime left_utime,
                                  const ImageFrame& right, std::size_t image,
                                  std::vector<Track>& tracks);

 private:
  CameraModel right_;
  double min_contrast_;
  StereoMatcher matcher_;
  EqualisedImage image_;
};

}  // namespace dive::estimation
