#include "mission/report/packed.h"

#include <bit>

#include <nlohmann/json.hpp>

#include "mission/report/base64.h"

namespace dive::mission {
namespace {

static_assert(std::endian::native == std::endian::little);

template <typename Value>
nlohmann::ordered_json pack(const char* type, std::span<const Value> values) {
  return {{type, base64(std::as_bytes(values))}};
}

}  // namespace

nlohmann::ordered_json packed(std::span<const float> values) { return pack("f32", values); }
nlohmann::ordered_json packed(std::span<const std::int16_t> values) { return pack("i16", values); }
nlohmann::ordered_json packed(std::span<const std::uint16_t> values) { return pack("u16", values); }
nlohmann::ordered_json packed(std::span<const std::uint32_t> values) { return pack("u32", values); }

}  // namespace dive::mission
