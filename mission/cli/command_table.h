#pragma once
// All commands with their options as data, read from the one definition of them (options.h). Man
// pages and completions are made from this table.

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace dive::mission {

struct OptionEntry {
  std::string name;  ///< "--seed"; of a positional argument "MISSION".
  std::string type;  ///< Type of its value, "FILE"; empty for a flag.
  std::string help;
  std::vector<std::string> choices;  ///< The words that it takes; empty: any.
  bool is_positional = false;
  bool is_required = false;
  bool is_list = false;  ///< Takes several values.
};

struct CommandEntry {
  std::string name;  ///< Empty: the program itself.
  std::string sentence;
  std::string text;
  std::vector<std::string> examples;
  std::vector<OptionEntry> options;
};

struct CommandTable {
  std::string version;
  CommandEntry program;
  std::vector<CommandEntry> commands;  ///< Without hidden ones, in the order of `dive --help`.
};

[[nodiscard]] CommandTable command_table(const CLI::App& app, const std::string& version);

}  // namespace dive::mission
