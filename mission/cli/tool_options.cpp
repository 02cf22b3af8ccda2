#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "mission/cli/options.h"
#include "mission/export/export_format.h"

namespace dive::mission {
namespace {

std::string names_of(ExportKind kind) {
  std::vector<const char*> names;
  for (const ExportFormat format : formats_of(kind)) names.push_back(to_string(format));
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

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

void add_export(CLI::App& app, ExportArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "export",
      "Examples:\n"
      "  dive export missions/window.xml --format gltf                 map and planned path\n"
      "  dive export survey.xml --format geojson --output survey.geojson   for a GIS\n"
      "  dive export dive-runs/window-seed1.lcmlog --format mcap       Foxglove, PlotJuggler\n"
      "  dive export dive-runs/window-seed1.lcmlog --format csv        the track as a table\n"
      "  dive export missions/maps/wreck.sdf --format ply              CloudCompare, ParaView\n"
      "  dive export plan.json --format csv                            the waypoints as a table\n\n"
      "Writes a mission with its plan, a plan, a log, a map or a point cloud for other tools.\n" +
          fmt::format(
              "Missions: {}; logs: {};\nplans: {}; maps and clouds: {}. geojson and kml need "
              "the mission's <origin>.",
              names_of(ExportKind::kMission), names_of(ExportKind::kLog),
              names_of(ExportKind::kPlan), names_of(ExportKind::kMap)));
  command->add_option("FILE", arguments.file, "Mission, plan (JSON), log, map (SDF) or point cloud")
      ->type_name("FILE")
      ->required();
  command
      ->add_option("--format", arguments.format, fmt::format("{}", fmt::join(format_names(), ", ")))
      ->type_name("FORMAT")
      ->required()
      ->check(CLI::IsMember(format_names()));
  command
      ->add_option(
          "--output", arguments.output,
          "File to write (default: the name of FILE with the format, in the working folder)")
      ->type_name("FILE");
  command->add_option("--seed", arguments.seed, "Mission: seed of the path search")->type_name("N");
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--allow-outside", arguments.allow_outside, kOutsideHelp);
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
