#pragma once
// Reads and writes grey images as PNG files.

#include <string>

#include <tl/expected.hpp>

#include "common/measurements.h"

namespace dive::estimation {

/// Reads pixels and size only. Converts colour to grey and 16 bits to 8. Bounded: 20000 pixels a
/// side. An error names the file.
[[nodiscard]] tl::expected<ImageFrame, std::string> read_gray_png(const std::string& path);

/// Writes a grey image of 8 bits, packed fast rather than small; false if it cannot be written.
[[nodiscard]] bool write_gray_png(const std::string& path, const ImageFrame& frame);

}  // namespace dive::estimation
