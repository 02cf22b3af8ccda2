#include "mission/cli/usage_error.h"

#include <algorithm>
#include <optional>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "common/suggest.h"
#include "mission/cli/help_formatter.h"

namespace dive::mission {
namespace {

const CLI::App* selected(const CLI::App& app) {
  const std::vector<CLI::App*> commands = app.get_subcommands();
  return commands.empty() ? nullptr : commands.front();
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->get_group().empty()) names.push_back(command->get_name());
  }
  return names;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::string suggestion(const std::string& word, const std::vector<std::string>& candidates) {
  const std::string meant = did_you_mean(word, candidates);
  return meant.empty() ? "" : fmt::format(" ({})", meant);
}

std::string name_of(const std::string& word) { return word.substr(0, word.find('=')); }

bool is_option(const std::string& word) { return word.size() > 1 && word.front() == '-'; }

// No command was recognised: the first word is one that does not exist, or an option of none.
std::string describe_start(const CLI::App& app, const CLI::ParseError& error,
                           std::span<const std::string> words) {
  if (words.empty()) return "which command? 'dive --help' lists them";
  const std::string word = name_of(words.front());
  if (is_option(word)) {
    return fmt::format("there is no option {}{}", word, suggestion(word, option_names(app)));
  }
  if (std::ranges::count(command_names(app), word) > 0) return error.what();
  return fmt::format("there is no command '{}'{}", word, suggestion(word, command_names(app)));
}

// A value that is none of the words which its option takes.
std::optional<std::string> describe_value(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    const std::vector<std::string> choices = choices_of(*option);
    if (choices.empty()) continue;
    for (const std::string& value : option->results()) {
      if (std::ranges::count(choices, value) > 0) continue;
      return fmt::format("{} {}: must be one of {}{}", option->get_name(), value,
                         fmt::join(choices, ", "), suggestion(value, choices));
    }
  }
  return std::nullopt;
}

}  // namespace

std::string describe_usage_error(const CLI::App& app, const CLI::ParseError& error,
                                 std::span<const std::string> words) {
  const CLI::App* command = selected(app);
  if (command == nullptr) return describe_start(app, error, words);
  for (const std::string& word : app.remaining(true)) {
    if (!is_option(word)) continue;
    return fmt::format("{} has no option {}{}", command->get_name(), name_of(word),
                       suggestion(name_of(word), option_names(*command)));
  }
  if (dynamic_cast<const CLI::ValidationError*>(&error) != nullptr) {
    if (const auto described = describe_value(*command)) return *described;
  }
  return error.what();
}

}  // namespace dive::mission
