#include "vehicle/link/packet_layout.h"

#include <algorithm>
#include <optional>

namespace dive::link {
namespace {

class Walker {
 public:
  explicit Walker(std::span<const std::uint8_t> packet) : rest_(packet) {}

  [[nodiscard]] bool at_end() const { return rest_.empty(); }

  bool skip(std::size_t size) {
    if (rest_.size() < size) return false;
    rest_ = rest_.subspan(size);
    return true;
  }
  bool skip(const Run& run) {
    switch (run.kind) {
      case Run::Kind::kBytes:
        return skip(run.size);
      case Run::Kind::kText:
        return skip_text(run.size);
      case Run::Kind::kArray: {
        const auto count = length(run.limit);
        return count && skip(*count * run.size);
      }
      case Run::Kind::kTexts: {
        const auto count = length(run.limit);
        for (std::size_t i = 0; i < count.value_or(0); ++i) {
          if (!skip_text(run.size)) return false;
        }
        return count.has_value();
      }
    }
    return false;
  }

 private:
  /// Big-endian int32 in [0, limit].
  std::optional<std::size_t> length(std::size_t limit) {
    if (rest_.size() < kLengthSize) return std::nullopt;
    std::uint32_t value = 0;
    for (const std::uint8_t byte : rest_.first(kLengthSize)) value = (value << 8U) | byte;
    rest_ = rest_.subspan(kLengthSize);
    if (value > limit) return std::nullopt;
    return value;
  }
  bool skip_text(std::size_t max_size) {
    const auto size = length(max_size);
    if (!size || *size == 0 || rest_.size() < *size) return false;
    const auto content = rest_.first(*size);
    const auto zero = std::ranges::find(content, std::uint8_t{0});
    return zero == content.end() - 1 && skip(*size);
  }

  std::span<const std::uint8_t> rest_;
};

}  // namespace

bool fits(std::span<const Run> layout, std::span<const std::uint8_t> packet) {
  Walker walker(packet);
  return walker.skip(kFingerprintSize) &&
         std::ranges::all_of(layout, [&](const Run& run) { return walker.skip(run); }) &&
         walker.at_end();
}

}  // namespace dive::link
