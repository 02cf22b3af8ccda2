#pragma once
// Base64 (RFC 4648) of bytes, for pages and files that embed them.

#include <cstddef>
#include <span>
#include <string>

namespace dive::mission {

[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

}  // namespace dive::mission
