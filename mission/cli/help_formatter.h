#pragma once
// The help of `dive` and of its commands.

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace dive::mission {

/// A command's description is its examples, a blank line, and a text whose first sentence
/// summarises it: the command's own help prints all of it, the list of commands only the sentence.
class HelpFormatter final : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
};

/// The parts of a description.
struct CommandDescription {
  std::vector<std::string> examples;  ///< Lines without "Examples:" and without indentation.
  std::string text;                   ///< Without line breaks.
  std::string sentence;               ///< The first one, without its full stop.
};
[[nodiscard]] CommandDescription parts_of(const std::string& description);

/// The type of the option's value as written in its definition ("FILE"); empty for a flag.
[[nodiscard]] std::string type_of(const CLI::Option& option);
/// The words that it takes; empty if it takes any.
[[nodiscard]] std::vector<std::string> choices_of(const CLI::Option& option);

}  // namespace dive::mission
