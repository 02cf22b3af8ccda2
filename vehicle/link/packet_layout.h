#pragma once
// The shape of an LCM packet, checked before LCM's generated decoder sees it: that decoder trusts
// the lengths in the packet, allocates what they ask for, and throws at a negative one.

#include <cstddef>
#include <cstdint>
#include <span>

namespace dive::link {

/// One run of a packet's bytes.
struct Run {
  enum class Kind {
    kBytes,  ///< `size` bytes.
    kText,   ///< int32 length n in [1, size], n bytes, the last and only the last of them zero.
    kArray,  ///< int32 count n in [0, limit], n times `size` bytes.
  };
  Kind kind = Kind::kBytes;
  std::size_t size = 0;
  std::size_t limit = 0;
};

[[nodiscard]] constexpr Run bytes(std::size_t size) { return {Run::Kind::kBytes, size, 0}; }
[[nodiscard]] constexpr Run text(std::size_t max_size) { return {Run::Kind::kText, max_size, 0}; }
[[nodiscard]] constexpr Run array(std::size_t element_size, std::size_t max_count) {
  return {Run::Kind::kArray, element_size, max_count};
}

/// Is `packet` an 8-byte fingerprint followed by exactly these runs?
[[nodiscard]] bool fits(std::span<const Run> layout, std::span<const std::uint8_t> packet);

}  // namespace dive::link
