#pragma once
// Arrays of numbers in JSON: {"f32": BASE64} and so on, little-endian, which a browser turns into a
// typed array at once. Private to mission/report.

#include <cstdint>
#include <span>

#include <nlohmann/json_fwd.hpp>

namespace dive::mission {

[[nodiscard]] nlohmann::ordered_json packed(std::span<const float> values);
[[nodiscard]] nlohmann::ordered_json packed(std::span<const std::int16_t> values);
[[nodiscard]] nlohmann::ordered_json packed(std::span<const std::uint16_t> values);
[[nodiscard]] nlohmann::ordered_json packed(std::span<const std::uint32_t> values);

}  // namespace dive::mission
