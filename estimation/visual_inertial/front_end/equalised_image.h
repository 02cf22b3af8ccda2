#pragma once
// A camera's image with equalised contrast, and the same at half the size. Internal.

#include <cstdint>
#include <vector>

#include "common/measurements.h"
#include "estimation/visual_inertial/front_end/local_contrast.h"
#include "estimation/visual_inertial/front_end/stereo.h"

namespace dive::estimation {

class EqualisedImage {
 public:
  /// Replaces the image; the statistics are those of the unprocessed one.
  ImageStatistics set(const ImageFrame& image) {
    width_ = image.width;
    height_ = image.height;
    const ImageStatistics statistics = even_contrast({image.pixels.data(), width_, height_}, full_);
    halve(full(), half_);
    return statistics;
  }

  [[nodiscard]] GrayView full() const { return {full_.data(), width_, height_}; }
  [[nodiscard]] GrayView half() const { return {half_.data(), width_ / 2, height_ / 2}; }
  [[nodiscard]] ImagePair both() const { return {full(), half()}; }

 private:
  std::vector<std::uint8_t> full_;
  std::vector<std::uint8_t> half_;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace dive::estimation
