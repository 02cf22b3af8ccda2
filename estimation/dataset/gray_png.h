#pragma once
// Grey pictures from PNG files, and to them.

#include <string>

#include <tl/expected.hpp>

#include "common/measurements.h"

namespace dive::estimation {

/// Pixels and size only. Colour is turned into grey, 16 bits into 8. Bounded: 20000 pixels a side.
/// An error names the file.
[[nodiscard]] tl::expected<ImageFrame, std::string> read_gray_png(const std::string& path);

/// A grey picture of 8 bits, packed fast rather than small; false when it cannot be written.
[[nodiscard]] bool write_gray_png(const std::string& path, const ImageFrame& frame);

}  // namespace dive::estimation
