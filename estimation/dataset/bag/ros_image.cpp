// Images in messages.

#include <algorithm>
#include <bit>

#include <fmt/format.h>

#include "estimation/dataset/bag/message_reader.h"
#include "estimation/dataset/bag/ros_message.h"
#include "estimation/dataset/gray_jpeg.h"
#include "estimation/dataset/gray_png.h"
#include "estimation/dataset/image_side.h"
#include "estimation/dataset/luma.h"

namespace dive::estimation {
namespace {

using Failure = tl::unexpected<std::string>;

constexpr const char* kCompressed = "sensor_msgs/CompressedImage";

// How the pixels of an encoding become grey.
struct Encoding {
  std::size_t bytes = 0;  ///< Bytes of a pixel.
  bool is_wide = false;   ///< 16 bits, of which the upper eight of those that are used are kept.
  int red = 0;            ///< Positions of colours; all zero for grey.
  int green = 0;
  int blue = 0;
};

tl::expected<Encoding, std::string> encoding_of(std::string_view name) {
  if (name == "mono8" || name == "8UC1") return Encoding{1, false, 0, 0, 0};
  if (name == "mono16" || name == "16UC1") return Encoding{2, true, 0, 0, 0};
  if (name == "bgr8" || name == "8UC3") return Encoding{3, false, 2, 1, 0};
  if (name == "rgb8") return Encoding{3, false, 0, 1, 2};
  if (name == "bgra8") return Encoding{4, false, 2, 1, 0};
  if (name == "rgba8") return Encoding{4, false, 0, 1, 2};
  return Failure(
      fmt::format("images encoded as \"{}\" are not read; mono8, mono16, bgr8, rgb8, "
                  "bgra8 and rgba8 are",
                  name));
}

// A sensor_msgs/Image after its header.
struct RawImage {
  std::size_t width = 0;
  std::size_t height = 0;
  std::size_t step = 0;  ///< Bytes of a row.
  bool is_big_endian = false;
  Encoding encoding;
  Bytes data;

  [[nodiscard]] const std::uint8_t* row(std::size_t y) const { return data.data() + y * step; }
  [[nodiscard]] unsigned wide(const std::uint8_t* pixel) const {
    const unsigned first = pixel[0];
    const unsigned second = pixel[1];
    return is_big_endian ? first << 8U | second : second << 8U | first;
  }
};

tl::expected<RawImage, std::string> read_raw(MessageReader& reader) {
  const auto height = reader.take<std::uint32_t>();
  const auto width = reader.take<std::uint32_t>();
  const std::string_view name = reader.take_text();
  const bool is_big_endian = reader.take<std::uint8_t>() != 0;
  const auto step = reader.take<std::uint32_t>();
  const Bytes data = reader.take_array();
  if (!reader.ok()) return Failure("the image is shorter than it states");
  const auto encoding = encoding_of(name);
  if (!encoding) return Failure(encoding.error());
  if (width == 0 || height == 0 || width > kMaxSide_px || height > kMaxSide_px ||
      step < width * encoding->bytes || data.size() < std::uint64_t{step} * height) {
    return Failure(fmt::format("an image of {} x {} pixels, rows of {} bytes, in {} bytes", width,
                               height, step, data.size()));
  }
  return RawImage{width, height, step, is_big_endian, *encoding, data};
}

ImageFrame to_frame(const RawImage& raw, int wide_bits) {
  ImageFrame frame;
  frame.width = static_cast<int>(raw.width);
  frame.height = static_cast<int>(raw.height);
  frame.pixels.reserve(raw.width * raw.height);
  const Encoding& encoding = raw.encoding;
  for (std::size_t y = 0; y < raw.height; ++y) {
    const std::uint8_t* pixel = raw.row(y);
    for (std::size_t x = 0; x < raw.width; ++x, pixel += encoding.bytes) {
      const unsigned grey =
          encoding.is_wide ? std::min(raw.wide(pixel) >> static_cast<unsigned>(wide_bits - 8), 255U)
          : encoding.bytes == 1
              ? *pixel
              : luma(pixel[encoding.red], pixel[encoding.green], pixel[encoding.blue]);
      frame.pixels.push_back(static_cast<std::uint8_t>(grey));
    }
  }
  return frame;
}

tl::expected<ImageFrame, std::string> read_compressed(MessageReader& reader) {
  static_cast<void>(reader.take_text());  // the format, which writers state in many ways
  const Bytes data = reader.take_array();
  if (!reader.ok()) return Failure("the image is shorter than it states");
  constexpr std::uint8_t kJpegStart[] = {0xFF, 0xD8};
  const bool is_jpeg =
      data.size() > 2 && std::equal(std::begin(kJpegStart), std::end(kJpegStart), data.begin());
  return is_jpeg ? decode_gray_jpeg(data) : decode_gray_png(data);
}

}  // namespace

bool is_image_type(std::string_view type) {
  return type == "sensor_msgs/Image" || type == kCompressed;
}

int used_bits(Bytes bytes, std::string_view type, Serialization kind) {
  if (type == kCompressed) return 0;
  MessageReader reader(bytes, kind);
  static_cast<void>(reader.take_header());
  const auto raw = read_raw(reader);
  if (!raw || !raw->encoding.is_wide) return 0;
  unsigned greatest = 0;
  for (std::size_t y = 0; y < raw->height; ++y) {
    const std::uint8_t* const row = raw->row(y);
    for (std::size_t x = 0; x < raw->width; ++x) {
      greatest = std::max(greatest, raw->wide(row + 2 * x));
    }
  }
  return static_cast<int>(std::bit_width(greatest));
}

tl::expected<ImageFrame, std::string> decode_image(Bytes bytes, std::string_view type,
                                                   Serialization kind, int wide_bits) {
  MessageReader reader(bytes, kind);
  const Utime utime = reader.take_header();
  if (!reader.ok() || utime < 0) return Failure("the image has no header");
  if (type == kCompressed) {
    auto frame = read_compressed(reader);
    if (frame) frame->utime = utime;
    return frame;
  }
  const auto raw = read_raw(reader);
  if (!raw) return Failure(raw.error());
  ImageFrame frame = to_frame(*raw, wide_bits);
  frame.utime = utime;
  return frame;
}

}  // namespace dive::estimation
