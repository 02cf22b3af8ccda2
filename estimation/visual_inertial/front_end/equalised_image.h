#pragma once
// A camera's image with equalised contrast, and the same at half the size. Internal.

#include <cstdint>
#include <string>
#include <vector>

#include "common/measurements.h"
#include "estimation/visual_inertial/front_end/local_contrast.h"
#include "estimation/visual_inertial/front_end/stereo.h"

namespace dive::estimation {

class EqualisedImage {
 public:
  /// For a tracker with these windows and levels of its pyramid.
  EqualisedImage(int window_px, int levels) : for_klt_(window_px, levels) {}

  /// Replaces the image; the statistics are those of the unprocessed one.
  ImageStatistics set(const ImageFrame& image) {
    width_ = image.width;
    height_ = image.height;
    const ImageStatistics statistics = even_contrast({image.pixels.data(), width_, height_}, full_);
    halve(full(), half_);
    return statistics;
  }
  /// To be called after set(), before for_klt(): not every image is tracked. Returns a library's
  /// exception as text, else empty.
  [[nodiscard]] std::string prepare() { return for_klt_.set(full()); }

  [[nodiscard]] GrayView full() const { return {full_.data(), width_, height_}; }
  [[nodiscard]] GrayView half() const { return {half_.data(), width_ / 2, height_ / 2}; }
  [[nodiscard]] const KltImage& for_klt() const { return for_klt_; }
  [[nodiscard]] ImagePair both() const { return {for_klt_, half()}; }

 private:
  std::vector<std::uint8_t> full_;
  std::vector<std::uint8_t> half_;
  KltImage for_klt_;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace dive::estimation
