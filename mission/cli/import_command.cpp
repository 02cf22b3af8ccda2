#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/terminal.h"
#include "mission/import/foreign_mission.h"

namespace dive::mission {
int run_import(const ImportArguments& arguments) {
  Diagnostics diagnostics;
  SourceText source;
  std::optional<ForeignMission> foreign =
      arguments.format == "acfr" ? read_acfr(arguments.file, diagnostics, source)
                                 : read_qgc(arguments.file, arguments.depth_m, diagnostics, source);
  nlohmann::ordered_json json;
  bool written = false;
  if (foreign) {
    foreign->id = as_id(std::filesystem::path(arguments.file).stem().string());
    report_defects(*foreign, source, diagnostics);
    ImportOptions options;
    options.speed = arguments.speed;
    options.seabed_m = arguments.seabed_m;
    const std::string name = std::filesystem::path(arguments.file).filename().string();
    const Imported imported = write_mission(*foreign, options, name);
    const std::filesystem::path folder = arguments.output;
    std::error_code ignored;  // what is wrong with the folder shows when the files are written
    std::filesystem::create_directories(folder, ignored);
    const std::string mission = (folder / (foreign->id + ".xml")).string();
    const std::string map = (folder / imported.map_name).string();
    written = write_file(mission, imported.mission_xml) && write_file(map, imported.map_sdf);
    json["mission"] = mission;
    json["map"] = map;
    json["legs"] = foreign->legs.size();
  }
  diagnostics.sort();
  json["ok"] = written;
  json["diagnostics"] = to_json(diagnostics);
  if (arguments.json) {
    print_json(json);
  } else {
    print_diagnostics(diagnostics);
    if (written) {
      print(fmt::format("{}: {} legs, written to {} and {}", arguments.file, foreign->legs.size(),
                        json["mission"].get<std::string>(), json["map"].get<std::string>()));
    } else {
      print(fmt::format("{}: not imported", arguments.file));
    }
  }
  return written ? kExitSuccess : kExitUsage;
}

}  // namespace dive::mission
