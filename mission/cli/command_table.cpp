#include "mission/cli/command_table.h"

#include <algorithm>

#include <CLI/CLI.hpp>

#include "mission/cli/help_formatter.h"

namespace dive::mission {
namespace {

OptionEntry entry_of(const CLI::Option& option) {
  OptionEntry entry;
  entry.is_positional = option.get_positional();
  const std::vector<std::string>& names = option.get_lnames();
  entry.name = names.empty() ? option.get_name(true) : "--" + names.front();
  entry.type = type_of(option);
  entry.help = option.get_description();
  std::ranges::replace(entry.help, '\n', ' ');
  entry.choices = choices_of(option);
  entry.is_required = option.get_required();
  entry.is_list = option.get_expected_max() == CLI::detail::expected_max_vector_size;
  return entry;
}

CommandEntry entry_of(const CLI::App& app) {
  CommandDescription parts = parts_of(app.get_description());
  CommandEntry entry{app.get_name(), parts.sentence, parts.text, parts.examples, {}};
  for (const CLI::Option* option : app.get_options()) entry.options.push_back(entry_of(*option));
  return entry;
}

}  // namespace

CommandTable command_table(const CLI::App& app, const std::string& version) {
  CommandTable table{version, entry_of(app), {}};
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->get_group().empty()) table.commands.push_back(entry_of(*command));
  }
  return table;
}

}  // namespace dive::mission
