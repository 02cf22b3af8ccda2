#pragma once
// What is wrong with a command line, and what was probably meant.

#include <span>
#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace dive::mission {

/// The error in words, with a suggestion for a mistyped command, option or value. `words` are the
/// arguments of the process, without its name.
[[nodiscard]] std::string describe_usage_error(const CLI::App& app, const CLI::ParseError& error,
                                               std::span<const std::string> words);

}  // namespace dive::mission
