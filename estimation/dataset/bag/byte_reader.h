#pragma once
// Bytes of a file that may be damaged, read in order: nothing is read beyond their end.

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace dive::estimation {

using Bytes = std::span<const std::uint8_t>;

/// Little-endian values. After a read beyond the end ok() is false, and every value read is zero or
/// empty; so it is enough to ask once, before the values are used.
class ByteReader {
 public:
  explicit ByteReader(Bytes bytes) : bytes_(bytes) {}

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - position_; }
  [[nodiscard]] bool at_end() const { return left() == 0; }

  template <typename Number>
  [[nodiscard]] Number take() {
    static_assert(std::endian::native == std::endian::little);
    Number value{};
    const Bytes bytes = take_bytes(sizeof value);
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }

  [[nodiscard]] Bytes take_bytes(std::uint64_t count) {
    if (count > left()) {
      ok_ = false;
      position_ = bytes_.size();
      return {};
    }
    const Bytes taken = bytes_.subspan(position_, static_cast<std::size_t>(count));
    position_ += taken.size();
    return taken;
  }

  /// A text after its length in 32 bits.
  [[nodiscard]] std::string_view take_text() {
    const Bytes bytes = take_bytes(take<std::uint32_t>());
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

 private:
  Bytes bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace dive::estimation
