#pragma once

#include <string>
#include <string_view>

namespace dive::mission {

/// SHA-256 of the bytes as 64 hex digits, as `sha256sum` prints it.
[[nodiscard]] std::string sha256(std::string_view bytes);

}  // namespace dive::mission
