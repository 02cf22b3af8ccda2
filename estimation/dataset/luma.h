#pragma once
// The grey of a colour, in images of every format.

#include <cstdint>

namespace dive::estimation {

/// By the weights of ITU-R BT.601, as in JPEG.
[[nodiscard]] constexpr std::uint8_t luma(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  return static_cast<std::uint8_t>((299U * red + 587U * green + 114U * blue + 500U) / 1000U);
}

}  // namespace dive::estimation
