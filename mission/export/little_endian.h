#pragma once
// Numbers in binary formats.

#include <bit>
#include <string>
#include <type_traits>

namespace dive::mission {

static_assert(std::endian::native == std::endian::little);

/// Appends the bytes of a number, the lowest first.
template <class Number>
requires std::is_arithmetic_v<Number>
void put(std::string& to, Number value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace dive::mission
