#include <nlohmann/json.hpp>

#include "mission/cli/bundle_file.h"
#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/executive/machine_graph.h"

namespace dive::mission {

int run_graph(const GraphArguments& arguments) {
  Diagnostics diagnostics;
  const std::optional<Mission> mission = load_mission_or_bundle(arguments.mission, diagnostics);
  if (!mission) {
    print_diagnostics(diagnostics);
    return kExitUsage;
  }
  tl::expected<Result, int> file = open_result(arguments.output, arguments.force);
  if (!file) return file.error();
  const Machine machine = build_machine(*mission);
  const std::string text =
      arguments.format == "dot" ? to_dot(machine, mission->id) : to_scxml(machine, mission->id);
  if (const int status = write_result(*file, text)) return status;
  if (arguments.json) {
    nlohmann::ordered_json json = {{"format", arguments.format}};
    if (*file) {
      json["output"] = arguments.output;
    } else {
      json["text"] = text;
    }
    print_json(json);
    return kExitSuccess;
  }
  if (*file) return kExitSuccess;
  print(std::string_view(text).substr(0, text.size() - 1));  // print() ends the line
  return kExitSuccess;
}

}  // namespace dive::mission
