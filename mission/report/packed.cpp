#include "mission/report/packed.h"

#include <bit>
#include <string>

#include <nlohmann/json.hpp>
#include <sodium.h>

namespace dive::mission {
namespace {

static_assert(std::endian::native == std::endian::little);

template <typename Value>
nlohmann::ordered_json pack(const char* type, std::span<const Value> values) {
  constexpr int kVariant = sodium_base64_VARIANT_ORIGINAL;
  const std::size_t size = values.size_bytes();
  std::string text(sodium_base64_ENCODED_LEN(size, kVariant), '\0');
  sodium_bin2base64(text.data(), text.size(), reinterpret_cast<const unsigned char*>(values.data()),
                    size, kVariant);
  text.pop_back();  // the terminating zero
  return {{type, std::move(text)}};
}

}  // namespace

nlohmann::ordered_json packed(std::span<const float> values) { return pack("f32", values); }
nlohmann::ordered_json packed(std::span<const std::int16_t> values) { return pack("i16", values); }
nlohmann::ordered_json packed(std::span<const std::uint16_t> values) { return pack("u16", values); }
nlohmann::ordered_json packed(std::span<const std::uint32_t> values) { return pack("u32", values); }

}  // namespace dive::mission
