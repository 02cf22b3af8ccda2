#pragma once
// FNV-1a, 64 bits (Fowler, Noll, Vo): detects damage, not tampering.

#include <cstdint>
#include <span>
#include <string_view>

namespace dive {

class Fnv1a64 {
 public:
  void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) mix(byte);
  }
  void add(std::string_view text) {
    for (const char c : text) mix(static_cast<std::uint8_t>(c));
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  void mix(std::uint8_t byte) { value_ = (value_ ^ byte) * 0x100000001b3ULL; }

  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace dive
