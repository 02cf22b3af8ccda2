#pragma once

#include <string>

#include "mission/cli/command_table.h"

namespace dive::mission {

/// Completion for bash 4 and newer; needs nothing but bash.
[[nodiscard]] std::string bash_completion(const CommandTable& table);
/// Completion for zsh: the function _dive.
[[nodiscard]] std::string zsh_completion(const CommandTable& table);

}  // namespace dive::mission
