#pragma once
// Reads and writes grey images as PNG files.

#include <cstdint>
#include <span>
#include <string>

#include <tl/expected.hpp>

#include "common/measurements.h"

namespace dive::estimation {

/// Reads pixels and size only. Converts colour to grey and 16 bits to 8. Bounded: 20000 pixels a
/// side. An error names the file.
[[nodiscard]] tl::expected<ImageFrame, std::string> read_gray_png(const std::string& path);

/// The same from the content of a file; the error is a clause.
[[nodiscard]] tl::expected<ImageFrame, std::string> decode_gray_png(
    std::span<const std::uint8_t> data);

/// The content of a PNG file of a grey image of 8 bits, packed fast rather than small.
[[nodiscard]] tl::expected<std::string, std::string> to_gray_png(const ImageFrame& frame);

}  // namespace dive::estimation
