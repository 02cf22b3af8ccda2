#pragma once
// Reads grey images from JPEG data.

#include <cstdint>
#include <span>
#include <string>

#include <tl/expected.hpp>

#include "common/measurements.h"

namespace dive::estimation {

/// Reads pixels and size only; converts colour to grey. Bounded as PNG files are. Damaged data is
/// an error, a clause with the reason.
[[nodiscard]] tl::expected<ImageFrame, std::string> decode_gray_jpeg(
    std::span<const std::uint8_t> data);

}  // namespace dive::estimation
