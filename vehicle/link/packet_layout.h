#pragma once
// The layout of an LCM packet, checked before LCM's generated decoder reads it: that decoder trusts
// the lengths in the packet, allocates accordingly, and throws at a negative one.

#include <cstddef>
#include <cstdint>
#include <span>

namespace dive::link {

/// One section of a packet.
struct Run {
  enum class Kind {
    kBytes,  ///< `size` bytes.
    kText,   ///< int32 length n in [1, size], then n bytes, of which only the last is zero.
    kArray,  ///< int32 count n in [0, limit], then n times `size` bytes.
    kTexts,  ///< int32 count n in [0, limit], then n times a kText of `size`.
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
[[nodiscard]] constexpr Run texts(std::size_t max_size, std::size_t max_count) {
  return {Run::Kind::kTexts, max_size, max_count};
}

inline constexpr std::size_t kFingerprintSize = 8;
inline constexpr std::size_t kLengthSize = 4;

/// Size of the largest packet with this layout, bytes.
[[nodiscard]] constexpr std::size_t max_size(std::span<const Run> layout) {
  std::size_t size = kFingerprintSize;
  for (const Run& run : layout) {
    switch (run.kind) {
      case Run::Kind::kBytes:
        size += run.size;
        break;
      case Run::Kind::kText:
        size += kLengthSize + run.size;
        break;
      case Run::Kind::kArray:
        size += kLengthSize + run.limit * run.size;
        break;
      case Run::Kind::kTexts:
        size += kLengthSize + run.limit * (kLengthSize + run.size);
        break;
    }
  }
  return size;
}

/// True if `packet` is an 8-byte fingerprint followed by exactly these runs.
[[nodiscard]] bool fits(std::span<const Run> layout, std::span<const std::uint8_t> packet);

}  // namespace dive::link
