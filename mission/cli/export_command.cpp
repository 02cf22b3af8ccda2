#include <algorithm>
#include <filesystem>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "common/input_file.h"
#include "mission/cli/commands.h"
#include "mission/cli/file_kind.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/output.h"
#include "mission/cli/plan_legs.h"
#include "mission/cli/terminal.h"
#include "mission/cli/work_progress.h"
#include "mission/export/export_format.h"
#include "mission/export/read_exported.h"
#include "planning/world/sdf.h"

namespace dive::mission {
namespace {

using Read = tl::expected<Exported, int>;

std::optional<ExportKind> export_kind(FileKind kind) {
  switch (kind) {
    case FileKind::kMission:
      return ExportKind::kMission;
    case FileKind::kLog:
      return ExportKind::kLog;
    case FileKind::kMap:
      return ExportKind::kMap;
    case FileKind::kCloud:
      return ExportKind::kCloud;
    case FileKind::kJson:
      return ExportKind::kPlan;
    case FileKind::kScenario:
    case FileKind::kBundle:
    case FileKind::kUnknown:
      break;
  }
  return std::nullopt;
}

// Planning takes time, and waypoints matter to every format.
Read read_mission_file(const ExportArguments& arguments) {
  Diagnostics diagnostics;
  const std::optional<LoadedMission> loaded =
      load(arguments.file, resources(arguments.allow_outside), diagnostics);
  std::optional<GeoPoint> map_origin;
  if (loaded && has_simulation_map(loaded->mission)) {
    Diagnostics shown;  // load() reports them
    map_origin = planning::sdf_origin(loaded->map, shown);
  }
  print_diagnostics(diagnostics);
  if (!loaded) return tl::unexpected<int>(kExitUsage);
  const planning::Scene scene(loaded->world);
  const Route route = nominal_route(loaded->mission, scene);
  const std::vector<PlannedRouteLeg> legs =
      plan_legs(*loaded, route, arguments.seed, arguments.json);
  Diagnostics failed;
  report_failed_plans(route, legs, loaded->mission, failed);
  print_diagnostics(failed);
  if (failed.error_count() > 0) return tl::unexpected<int>(kExitFailed);
  return exported_mission(loaded->mission, loaded->world, legs, map_origin);
}

Read read_plan_file(const ExportArguments& arguments) {
  const auto plan = read_plan(arguments.file);
  if (!plan) return tl::unexpected<int>(kExitUsage);
  auto exported = exported_plan(std::filesystem::path(arguments.file).stem().string(), *plan);
  if (exported) return std::move(*exported);
  complain(fmt::format("{}: {}", arguments.file, exported.error()));
  return tl::unexpected<int>(kExitUsage);
}

Read read_log_file(const ExportArguments& arguments) {
  SteadyClock clock;
  WorkProgress progress(clock, "reading", arguments.json);
  tl::expected<Exported, std::string> exported =
      exported_log(arguments.file, [&](double share) { progress.show(share); });
  if (exported) return std::move(*exported);
  complain(exported.error());
  return tl::unexpected<int>(kExitUsage);
}

Read read_map_file(const ExportArguments& arguments) {
  Diagnostics diagnostics;
  const std::optional<planning::World> world =
      planning::load_sdf(arguments.file, diagnostics, resources(arguments.allow_outside));
  print_diagnostics(diagnostics);
  if (!world) return tl::unexpected<int>(kExitUsage);
  return exported_map(std::filesystem::path(arguments.file).stem().string(), *world);
}

Read read_cloud_file(const ExportArguments& arguments) {
  tl::expected<planning::CloudFile, std::string> cloud =
      planning::read_cloud(arguments.file, planning::CloudOptions{});
  if (!cloud) {
    complain(fmt::format("{}: {}", arguments.file, cloud.error()));
    return tl::unexpected<int>(kExitUsage);
  }
  for (const std::string& warning : cloud->warnings) note("dive: " + warning);
  return exported_cloud(std::filesystem::path(arguments.file).stem().string(), std::move(*cloud));
}

Read read(ExportKind kind, const ExportArguments& arguments) {
  switch (kind) {
    case ExportKind::kMission:
      return read_mission_file(arguments);
    case ExportKind::kPlan:
      return read_plan_file(arguments);
    case ExportKind::kLog:
      return read_log_file(arguments);
    case ExportKind::kMap:
      return read_map_file(arguments);
    case ExportKind::kCloud:
      break;
  }
  return read_cloud_file(arguments);
}

// Prints an error if this kind of file has not this format.
bool can_export(FileKind file, ExportFormat format, const std::string& path) {
  const std::optional<ExportKind> kind = export_kind(file);
  const auto readable = open_input_stream(path);
  if (!readable) {
    complain(fmt::format("{}: the file cannot be read: {}", path, readable.error()));
    return false;
  }
  if (!kind) {
    complain(fmt::format(
        "{}: this is {}: missions, plans (JSON), logs, maps and point clouds can be exported", path,
        in_words(file)));
    return false;
  }
  const std::span<const ExportFormat> formats = formats_of(*kind);
  if (std::ranges::find(formats, format) != formats.end()) return true;
  std::vector<std::string> names;
  for (const ExportFormat each : formats) names.emplace_back(to_string(each));
  complain(fmt::format("{}: {} cannot become {}: write --format {}", path, in_words(file),
                       to_string(format), fmt::join(names, ", ")));
  return false;
}

std::string output_of(const ExportArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  return std::filesystem::path(arguments.file).stem().string() + "." + arguments.format;
}

}  // namespace

int run_export(const ExportArguments& arguments) {
  const FileKind kind = kind_of_file(arguments.file);  // also notes that the file is an input
  const ExportFormat format = find_format(arguments.format);
  if (!can_export(kind, format, arguments.file)) return kExitUsage;
  const std::string output = output_of(arguments);
  tl::expected<Result, int> result = open_result(output, arguments.force);
  if (!result) return result.error();
  const Read exported = read(*export_kind(kind), arguments);
  if (!exported) return exported.error();
  if (needs_origin(format) && !exported->origin) {
    complain(
        fmt::format("{}: {} needs the place of x = y = 0 on the earth: add <origin "
                    "latitude=\"...\" longitude=\"...\"/> to the mission",
                    arguments.file, arguments.format));
    return kExitUsage;
  }
  const std::string text = export_as(format, *exported);
  if (const int status = write_result(*result, text)) return status;
  if (arguments.json) {
    print_json({{"output", output}, {"format", arguments.format}, {"bytes", text.size()}});
  } else {
    print(fmt::format("{} {} ({})", arguments.format, output, rounded_size(text.size())));
  }
  return kExitSuccess;
}

}  // namespace dive::mission
