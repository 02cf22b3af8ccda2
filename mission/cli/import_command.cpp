#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/commands.h"
#include "mission/cli/file_kind.h"
#include "mission/cli/json.h"
#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/import/foreign_mission.h"

namespace dive::mission {
namespace {

struct Written {
  std::string mission;
  std::string map;
  double speed = 0.0;  ///< m/s
};

/// Prints an error and returns the exit status if a file cannot be written. The mission is written
/// last: it never stands there without its map.
tl::expected<Written, int> write(const Imported& imported, const std::string& id,
                                 const ImportArguments& arguments) {
  const std::filesystem::path folder(arguments.output);
  Written written{(folder / (id + ".xml")).string(), (folder / imported.map_name).string(),
                  imported.speed};
  tl::expected<Result, int> mission = open_result(written.mission, arguments.force);
  if (!mission) return tl::unexpected(mission.error());
  tl::expected<Result, int> map = open_result(written.map, arguments.force);
  if (!map) return tl::unexpected(map.error());
  int status = write_result(*map, imported.map_sdf);
  if (status == kExitSuccess) status = write_result(*mission, imported.mission_xml);
  if (status != kExitSuccess) return tl::unexpected(status);
  return written;
}

// Notes are part of the result: one line each on stdout. All others are diagnostics.
void print_report(const ImportArguments& arguments, const Diagnostics& diagnostics,
                  const tl::expected<Written, int>& written, std::size_t legs) {
  Diagnostics problems;
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    if (diagnostic.severity != Severity::kNote) problems.add(diagnostic);
  }
  print_diagnostics(problems);
  if (!written) return print(fmt::format("{}: not imported", arguments.file));
  print(fmt::format("{}: {} legs at {:g} m/s, written to {} and {}", arguments.file, legs,
                    written->speed, written->mission, written->map));
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    if (diagnostic.severity != Severity::kNote) continue;
    print(fmt::format("  line {}: {} [{}]", diagnostic.span.line, diagnostic.message,
                      diagnostic.code));
  }
}

std::optional<ForeignMission> read(const ImportArguments& arguments, ImportReport& report) {
  Diagnostics diagnostics;
  if (!is_text_of(FileKind::kMission, arguments.file, diagnostics)) {
    report.add(diagnostics);
    return std::nullopt;
  }
  if (arguments.format == "acfr") return read_acfr(arguments.file, report);
  return read_qgc(arguments.file, arguments.depth_m, report);
}

}  // namespace

int run_import(const ImportArguments& arguments) {
  ImportReport report;
  std::optional<ForeignMission> foreign = read(arguments, report);
  tl::expected<Written, int> written = tl::unexpected<int>(kExitUsage);
  const std::size_t legs = foreign ? foreign->legs.size() : 0;
  if (foreign) {
    foreign->id = as_id(std::filesystem::path(arguments.file).stem().string());
    report_defects(*foreign, report);
    const ImportOptions options{.speed = arguments.speed, .seabed_m = arguments.seabed_m};
    const std::string name = std::filesystem::path(arguments.file).filename().string();
    written = write(write_mission(*foreign, options, name, report), foreign->id, arguments);
  }
  const Diagnostics diagnostics = report.diagnostics();
  if (arguments.json) {
    nlohmann::ordered_json json;
    if (written) {
      json["mission"] = written->mission;
      json["map"] = written->map;
      json["legs"] = legs;
      json["speed"] = written->speed;
    }
    json["ok"] = written.has_value();
    json["diagnostics"] = to_json(diagnostics);
    print_json(json);
  } else {
    print_report(arguments, diagnostics, written, legs);
  }
  return written ? kExitSuccess : written.error();
}

}  // namespace dive::mission
