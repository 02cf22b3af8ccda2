#include "estimation/visual_inertial/front_end/image_check.h"

#include <cstddef>
#include <utility>

#include <fmt/format.h>

namespace dive::estimation {
namespace {

bool refuse(ImageQuality& quality, ImageFault fault, std::string reason) {
  quality.fault = fault;
  quality.reason = std::move(reason);
  return false;
}

}  // namespace

std::string format_problem(const ImageFrame& image, const CameraModel& camera) {
  const bool is_grey = image.format == ImageFrame::Format::kGray8;
  if (is_grey && image.width == camera.width && image.height == camera.height &&
      image.pixels.size() ==
          static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)) {
    return {};
  }
  return fmt::format(
      "a {} picture of {} x {} pixels in {} bytes, where a grey one of {} x {} was "
      "agreed",
      is_grey ? "grey" : "colour", image.width, image.height, image.pixels.size(), camera.width,
      camera.height);
}

ImageCheck::ImageCheck(const CameraModel& camera, double min_contrast)
    : camera_(camera), min_contrast_(min_contrast) {}

bool ImageCheck::check(const ImageFrame& image, ImageQuality& quality) const {
  if (std::string problem = format_problem(image, camera_); !problem.empty()) {
    return refuse(quality, ImageFault::kNotAsAgreed, std::move(problem));
  }
  if (last_utime_ && image.utime <= *last_utime_) {
    return refuse(
        quality, ImageFault::kNotLater,
        fmt::format("stamped {} us, and the one before {} us", image.utime, *last_utime_));
  }
  if (last_utime_ && image.pixels == last_pixels_) {
    return refuse(quality, ImageFault::kFrozen,
                  "bit for bit the picture before: the camera is frozen");
  }
  return true;
}

bool ImageCheck::check_contrast(const ImageStatistics& statistics, ImageQuality& quality) const {
  quality.brightness = statistics.brightness;
  quality.contrast = statistics.contrast;
  quality.sharpness = statistics.sharpness;
  if (quality.contrast >= min_contrast_) return true;
  return refuse(
      quality, ImageFault::kNoContrast,
      fmt::format(
          "nothing to see: mean {:.1f}, standard deviation {:.1f} of 255, where {:.1f} is needed",
          quality.brightness, quality.contrast, min_contrast_));
}

void ImageCheck::set_last(const ImageFrame& image) {
  last_pixels_ = image.pixels;
  last_utime_ = image.utime;
}

}  // namespace dive::estimation
