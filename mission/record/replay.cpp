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

/// What a log's dive was made of.
struct Dived {
  planning::World world;
  vehicle::Model model;
  ExecutiveOptions options;
};

tl::expected<Mission, std::string> mission_of(const LogHeader& header) {
  Diagnostics diagnostics;
  std::optional<Mission> mission = parse_mission(
      SourceText(header.mission_name, header.mission_xml), diagnostics, MapFile::kNotNeeded);
  if (!mission) return unreadable("mission", diagnostics);
  return std::move(*mission);
}

tl::expected<planning::World, std::string> world_of(const LogHeader& header) {
  Diagnostics diagnostics;
  planning::MeshBundle meshes(header.map_meshes);
  std::optional<planning::World> world =
      planning::parse_sdf(SourceText(header.map_name, header.map_xml), diagnostics, meshes);
  if (!world) return unreadable("map", diagnostics);
  return std::move(*world);
}

// As the vehicle that dived `mission` knew it.
tl::expected<Dived, std::string> dived_of(const LogHeader& header, const Mission& mission) {
  Diagnostics diagnostics;
  tl::expected<planning::World, std::string> world;
  if (!mission.unknown) world = world_of(header);
  if (!world) return tl::unexpected(world.error());
  std::optional<vehicle::Model> model =
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
  return Dived{std::move(*world), std::move(*model), std::move(options)};
}

/// Feeds the log's inputs to an executive; `compare` is told every tick with what both say, and
/// ends it by returning false.
template <typename Compare>
ReplayReport feed(LogReader& log, Executive& executive, Compare compare) {
  ReplayReport report;
  while (const std::optional<LoggedTick> tick = log.next()) {
    ++report.ticks;
    const StepOutputs& replayed = executive.step(tick->inputs);
    if (report.first_divergence.empty()) {
      const std::string difference = first_difference(tick->outputs, replayed);
      if (!difference.empty()) {
        report.first_divergence =
            fmt::format("t = {:.2f} s: {}", to_seconds(tick->inputs.now), difference);
      }
    }
    if (!compare(*tick, replayed, report)) break;
  }
  report.events = log.events_read();
  report.torn = log.torn();
  report.identical = report.first_divergence.empty() && report.ticks > 0;
  return report;
}

}  // namespace

tl::expected<ReplayReport, std::string> replay(LogReader& log) {
  const tl::expected<Mission, std::string> mission = mission_of(log.header());
  if (!mission) return tl::unexpected(mission.error());
  const tl::expected<Dived, std::string> dived = dived_of(log.header(), *mission);
  if (!dived) return tl::unexpected(dived.error());
  Executive executive(*mission, dived->world, dived->model, dived->options);
  return feed(log, executive,
              [](const LoggedTick&, const StepOutputs&, const ReplayReport& report) {
                return report.first_divergence.empty();
              });
}

tl::expected<WhatIf, std::string> replay_with(LogReader& log, const Mission& changed) {
  const tl::expected<Mission, std::string> mission = mission_of(log.header());
  if (!mission) return tl::unexpected(mission.error());
  tl::expected<Dived, std::string> dived = dived_of(log.header(), *mission);
  if (!dived) return tl::unexpected(dived.error());
  if (dived->options.resume) {
    return tl::unexpected(std::string(
        "this dive went on from another one: its states may not be those of a changed mission"));
  }
  Executive executive(changed, dived->world, dived->model, dived->options);
  WhatIf what_if;
  what_if.report = feed(
      log, executive, [&](const LoggedTick& tick, const StepOutputs& outputs, const ReplayReport&) {
        const double t_s = to_seconds(tick.inputs.now);
        for (const TransitionRecord& record : tick.outputs.transitions) {
          what_if.logged.push_back({t_s, record});
        }
        for (const TransitionRecord& record : outputs.transitions) {
          what_if.replayed.push_back({t_s, record});
        }
        return true;
      });
  return what_if;
}

}  // namespace dive::mission
