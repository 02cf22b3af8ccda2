#pragma once

#include <string>

#include "mission/cli/command_table.h"

namespace dive::mission {

/// The page dive(1), in the macros of man(7).
[[nodiscard]] std::string man_page(const CommandTable& table);
/// The page dive-NAME(1) of a command.
[[nodiscard]] std::string man_page(const CommandTable& table, const CommandEntry& command);

}  // namespace dive::mission
