#include "estimation/dataset/gray_png.h"

#include <cstddef>

#include <fmt/format.h>
#include <png.h>

#include "common/assert.h"

namespace dive::estimation {

tl::expected<ImageFrame, std::string> read_gray_png(const std::string& path) {
  constexpr png_uint_32 kMaxSide_px = 20'000;
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  const auto fail = [&](const std::string& what) {
    png_image_free(&image);
    return tl::make_unexpected(fmt::format("{}: {}", path, what));
  };
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) return fail(image.message);
  if (image.width > kMaxSide_px || image.height > kMaxSide_px) {
    return fail(fmt::format("a picture of {} x {} pixels is too large", image.width, image.height));
  }
  image.format = PNG_FORMAT_GRAY;
  ImageFrame frame;
  frame.width = static_cast<int>(image.width);
  frame.height = static_cast<int>(image.height);
  frame.pixels.resize(static_cast<std::size_t>(image.width) * image.height);
  if (png_image_finish_read(&image, nullptr, frame.pixels.data(), 0, nullptr) == 0) {
    return fail(image.message);
  }
  return frame;
}

bool write_gray_png(const std::string& path, const ImageFrame& frame) {
  DIVE_DEMAND(frame.format == ImageFrame::Format::kGray8 &&
              frame.pixels.size() == static_cast<std::size_t>(frame.width * frame.height));
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(frame.width);
  image.height = static_cast<png_uint_32>(frame.height);
  image.format = PNG_FORMAT_GRAY;
  image.flags = PNG_IMAGE_FLAG_FAST;
  return png_image_write_to_file(&image, path.c_str(), 0, frame.pixels.data(), 0, nullptr) != 0;
}

}  // namespace dive::estimation
