#include "estimation/dataset/gray_png.h"

#include <cstddef>

#include <fmt/format.h>
#include <png.h>

#include "common/assert.h"
#include "common/input_file.h"
#include "estimation/dataset/image_side.h"
#include "estimation/dataset/luma.h"

namespace dive::estimation {

namespace {

// Reads the image whose header has been read; frees `image`. The error is a clause.
tl::expected<ImageFrame, std::string> finish(png_image& image) {
  const auto fail = [&](const std::string& what) {
    png_image_free(&image);
    return tl::make_unexpected(what);
  };
  if (image.width > kMaxSide_px || image.height > kMaxSide_px) {
    return fail(fmt::format("an image of {} x {} pixels is too large", image.width, image.height));
  }
  // Otherwise 16 bits are taken as linear in light, unlike 8 bits, and brightened.
  image.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
  const bool is_colour = (image.format & PNG_FORMAT_FLAG_COLOR) != 0;
  image.format = is_colour ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY;
  ImageFrame frame;
  frame.width = static_cast<int>(image.width);
  frame.height = static_cast<int>(image.height);
  const std::size_t count = static_cast<std::size_t>(image.width) * image.height;
  frame.pixels.resize(is_colour ? 3 * count : count);
  if (png_image_finish_read(&image, nullptr, frame.pixels.data(), 0, nullptr) == 0) {
    return fail(image.message);
  }
  if (!is_colour) return frame;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* const rgb = frame.pixels.data() + 3 * i;
    frame.pixels[i] = luma(rgb[0], rgb[1], rgb[2]);
  }
  frame.pixels.resize(count);
  return frame;
}

}  // namespace

tl::expected<ImageFrame, std::string> read_gray_png(const std::string& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  const auto fail = [&](const std::string& what) {
    png_image_free(&image);
    return tl::make_unexpected(fmt::format("{}: {}", path, what));
  };
  const auto file = open_input_stdio(path);
  if (!file) return fail(file.error());
  if (png_image_begin_read_from_stdio(&image, file->get()) == 0) return fail(image.message);
  auto frame = finish(image);
  if (!frame) return fail(frame.error());
  return frame;
}

tl::expected<ImageFrame, std::string> decode_gray_png(std::span<const std::uint8_t> data) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, data.data(), data.size()) == 0) {
    png_image_free(&image);
    return tl::make_unexpected(std::string("damaged PNG data: ") + image.message);
  }
  return finish(image);
}

tl::expected<std::string, std::string> to_gray_png(const ImageFrame& frame) {
  DIVE_DEMAND(frame.format == ImageFrame::Format::kGray8 &&
              frame.pixels.size() == static_cast<std::size_t>(frame.width * frame.height));
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(frame.width);
  image.height = static_cast<png_uint_32>(frame.height);
  image.format = PNG_FORMAT_GRAY;
  image.flags = PNG_IMAGE_FLAG_FAST;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string png(size, '\0');
  if (png_image_write_to_memory(&image, png.data(), &size, 0, frame.pixels.data(), 0, nullptr) ==
      0) {
    return tl::unexpected(std::string(image.message));
  }
  png.resize(size);
  return png;
}

}  // namespace dive::estimation
