#pragma once
// Opens the link for a command, as its options say, and prepares the process for it.

#include <optional>

#include "mission/cli/commands.h"
#include "vehicle/link/bus.h"

namespace dive::mission {

/// Prints an error and returns nothing if the key or the URL is of no use, and for an executive or
/// a supervisor whose packets leave the machine without a key, unless --insecure permits that.
[[nodiscard]] std::optional<link::Bus> open_link(const LinkArguments& arguments, link::Role role);

/// Real-time priority for this process; prints a note if the system does not permit it. Call it
/// before open_link(), because the bus's own thread must not wait either.
void request_realtime_priority();

}  // namespace dive::mission
