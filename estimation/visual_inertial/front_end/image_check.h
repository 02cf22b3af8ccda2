#pragma once
// Checks of an image before it is tracked: format, stamp, frozen camera, contrast. Internal.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/clock.h"
#include "common/measurements.h"
#include "estimation/visual_inertial/front_end/image_quality.h"
#include "estimation/visual_inertial/front_end/local_contrast.h"

namespace dive::estimation {

/// The difference between an image's format and the camera's, as text; empty if they agree.
[[nodiscard]] std::string format_problem(const ImageFrame& image, const CameraModel& camera);

/// The checks of one camera's images.
class ImageCheck {
 public:
  /// `min_contrast`: least standard deviation, grey levels.
  ImageCheck(const CameraModel& camera, double min_contrast);

  /// True if the image is usable so far; else sets fault and reason.
  [[nodiscard]] bool check(const ImageFrame& image, ImageQuality& quality) const;
  /// Sets the statistics; true if the contrast suffices, else sets fault and reason.
  [[nodiscard]] bool check_contrast(const ImageStatistics& statistics, ImageQuality& quality) const;
  /// The next image is compared with this one.
  void set_last(const ImageFrame& image);
  /// Stamp of that image.
  [[nodiscard]] std::optional<Utime> last_utime() const { return last_utime_; }

 private:
  CameraModel camera_;
  double min_contrast_;
  std::optional<Utime> last_utime_;
  std::vector<std::uint8_t> last_pixels_;
};

}  // namespace dive::estimation
