#pragma once
// The data of a report's page, as a browser reads them.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace dive::mission::testing {

/// The JSON in the page; throws if there is none.
[[nodiscard]] nlohmann::json data_of(const std::string& page);

/// A packed list of 32-bit floating-point numbers.
[[nodiscard]] std::vector<float> floats_of(const nlohmann::json& packed);
/// A packed list of 16-bit integers.
[[nodiscard]] std::vector<std::int16_t> shorts_of(const nlohmann::json& packed);

/// Number of times that `word` occurs in `text`.
[[nodiscard]] std::size_t count_of(std::string_view text, std::string_view word);

}  // namespace dive::mission::testing
