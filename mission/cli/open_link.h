#pragma once
// Opens the link for a command, as its options say.

#include <optional>

#include "mission/cli/commands.h"
#include "vehicle/link/bus.h"

namespace dive::mission {

/// Prints an error and returns nothing if the key or the URL is of no use, and for an executive or
/// a supervisor whose packets leave the machine without a key, unless --insecure permits that.
[[nodiscard]] std::optional<link::Bus> open_link(const LinkArguments& arguments, link::Role role);

}  // namespace dive::mission
