#include "mission/record/replay.h"

#include <optional>

#include <fmt/format.h>

#include "common/diagnostic.h"
#include "mission/document/mission.h"
#include "mission/executive/executive.h"
#include "mission/record/journal.h"
#include "planning/world/sdf.h"
#include "vehicle/model.h"

namespace dive::mission {
namespace {

tl::unexpected<std::string> unreadable(const char* what, const Diagnostics& diagnostics) {
  const std::string first = diagnostics.list().empty() ? "" : diagnostics.list().front().message;
  return tl::unexpected(fmt::format("the {} in the log is not accepted: {}", what, first));
}

}  // namespace

tl::expected<ReplayReport, std::string> replay(LogReader& log) {
  const LogHeader& header = log.header();
  Diagnostics diagnostics;
  const std::optional<Mission> mission = parse_mission(
      SourceText(header.mission_name, header.mission_xml), diagnostics, MapFile::kNotNeeded);
  if (!mission) return unreadable("mission", diagnostics);
  planning::MeshBundle meshes(header.map_meshes);
  const std::optional<planning::World> world =
      planning::parse_sdf(SourceText(header.map_name, header.map_xml), diagnostics, meshes);
  if (!world) return unreadable("map", diagnostics);
  const std::optional<vehicle::Model> model =
      vehicle::parse_urdf(SourceText("vehicle", header.vehicle_urdf), diagnostics);
  if (!model) return unreadable("vehicle", diagnostics);

  ExecutiveOptions options;
  options.seed = header.seed;
  if (!header.resume.empty()) {
    tl::expected<Journal, std::string> journal = parse_journal(header.resume);
    if (!journal)
      return tl::unexpected("the journal in the log is not accepted: " + journal.error());
    if (journal->committed) {
      options.resume =
          Resume{std::move(*journal->committed), std::move(journal->trail), header.resume_gap_s};
    }
  }
  Executive executive(*mission, *world, *model, options);
  ReplayReport report;
  while (const std::optional<LoggedTick> tick = log.next()) {
    ++report.ticks;
    const StepOutputs& replayed = executive.step(tick->inputs);
    const std::string difference = first_difference(tick->outputs, replayed);
    if (difference.empty()) continue;
    report.first_divergence =
        fmt::format("t = {:.2f} s: {}", to_seconds(tick->inputs.now), difference);
    break;
  }
  report.events = log.events_read();
  report.torn = log.torn();
  report.identical = report.first_divergence.empty() && report.ticks > 0;
  return report;
}

}  // namespace dive::mission
