#include <CLI/CLI.hpp>

#include "mission/cli/options.h"

namespace dive::mission {

void add_new(CLI::App& app, NewArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "new",
      "Examples:\n"
      "  dive new transect survey.xml      rows over a seabed, at constant altitude\n"
      "  dive new penetration wreck.xml    into a wreck and out again\n"
      "  dive new goals                    a list of places: goals.xml\n\n"
      "Writes a commented mission to begin with, and its map beside it. Both are small and pass\n"
      "dive check: change one thing at a time, and check again.");
  command->add_option("KIND", arguments.kind, "transect, penetration or goals")
      ->type_name("KIND")
      ->required()
      ->check(CLI::IsMember({"transect", "penetration", "goals"}));
  command->add_option("FILE", arguments.file, "Mission file to write (default: KIND.xml)")
      ->type_name("FILE");
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_lsp(CLI::App& app, LspArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "lsp",
      "Examples:\n"
      "  dive lsp      an editor starts it: doc/how-to/set-up-an-editor.md\n\n"
      "Serves an editor of missions over the Language Server Protocol on standard input and\n"
      "output: the findings of dive check --static while you type, completion by the schema, and\n"
      "on each leg its certified clearance.");
  command->add_flag("--stdio", arguments.stdio, "Standard input and output, as always");
}

void add_generate(CLI::App& app, GenerateArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "generate",
      "Examples:\n"
      "  dive generate share\n\n"
      "Writes man pages, and completions for bash and zsh, of all commands into a folder like\n"
      "/usr/share, and the reference of the mission language: share/doc/dive/mission-language.md.");
  command->group("");
  command->add_option("DIR", arguments.folder, "Folder")->type_name("DIR")->required();
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

}  // namespace dive::mission
