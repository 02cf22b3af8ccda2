#pragma once
// The largest image of a recording.

#include <cstdint>

namespace dive::estimation {

inline constexpr std::uint32_t kMaxSide_px = 20'000;  ///< Width and height.

}  // namespace dive::estimation
