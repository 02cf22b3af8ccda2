#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/command_table.h"
#include "mission/cli/commands.h"
#include "mission/cli/completion.h"
#include "mission/cli/json.h"
#include "mission/cli/man_page.h"
#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/document/language_reference.h"

namespace dive::mission {
namespace {

struct Generated {
  std::string path;  ///< Beneath the folder.
  std::string text;
};

// Where Debian's shells, man and readers look beneath /usr/share.
std::vector<Generated> generated(const CommandTable& table) {
  std::vector<Generated> files = {
      {"bash-completion/completions/dive", bash_completion(table)},
      {"zsh/vendor-completions/_dive", zsh_completion(table)},
      {"man/man1/dive.1", man_page(table)},
      {"doc/dive/mission-language.md", language_reference(Language(mission_schema()))},
  };
  for (const CommandEntry& command : table.commands) {
    files.push_back({fmt::format("man/man1/dive-{}.1", command.name), man_page(table, command)});
  }
  return files;
}

}  // namespace

int run_generate(const GenerateArguments& arguments, const CommandTable& table) {
  nlohmann::ordered_json names = nlohmann::ordered_json::array();
  for (const Generated& file : generated(table)) {
    const std::string path = arguments.folder + "/" + file.path;
    tl::expected<Result, int> result = open_result(path, arguments.force);
    if (!result) return result.error();
    if (const int status = write_result(*result, file.text)) return status;
    names.push_back(path);
    if (!arguments.json) print(path);
  }
  if (arguments.json) print_json({{"files", std::move(names)}});
  return kExitSuccess;
}

}  // namespace dive::mission
