#include "mission/record/replay.h"

#include <optional>
#include <utility>

#include <fmt/format.h>

#include "common/diagnostic.h"
#include "common/mathematics.h"
#include "mission/document/mission.h"
#include "mission/executive/executive.h"
#include "mission/executive/map_updates.h"
#include "mission/record/journal.h"
#include "planning/world/sdf.h"
#include "vehicle/model.h"

namespace dive::mission {
namespace {

tl::unexpected<std::string> unreadable(const char* what, const Diagnostics& diagnostics) {
  const std::string first = diagnostics.list().empty() ? "" : diagnostics.list().front().message;
  return tl::unexpected(fmt::format("the {} in the log is not accepted: {}", what, first));
}

/// The mission, map and vehicle of a log.
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

// Contains the map as the vehicle that dived `mission` had it.
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
    if (journal->checkpoint) {
      options.resume = Resume{std::move(*journal->checkpoint), std::move(journal->trail),
                              journal->trail_spacing_m, header.resume_gap_s};
    }
  }
  return Dived{std::move(*world), std::move(*model), std::move(options)};
}

/// Reads the log to its end. `replay_tick` is called for every tick before the first gap, until it
/// returns false.
template <typename ReplayTick>
ReplayReport read_all(LogReader& log, ReplayTick replay_tick) {
  ReplayReport report;
  if (log.header()) report.logged_mathematics = log.header()->mathematics;
  report.replayed_mathematics = mathematics();
  bool going = true;
  while (std::optional<LoggedTick> tick = log.next()) {
    ++report.ticks;
    going = going && log.gaps().empty();
    if (!going) continue;
    ++report.replayed;
    going = replay_tick(*tick, report);
  }
  report.events = log.events_read();
  report.gaps = log.gaps();
  report.torn = log.torn();
  report.identical = report.first_divergence.empty() && report.gaps.empty() && report.replayed > 0;
  if (report.logged_mathematics != report.replayed_mathematics) {
    report.mathematics_difference = std::exchange(report.first_divergence, {});
  }
  return report;
}

/// Feeds the log's inputs to an executive. `compare` is called for every tick with both outputs,
/// and stops the replay by returning false.
template <typename Compare>
ReplayReport feed(LogReader& log, Executive& executive, Compare compare) {
  planning::ObservedMap map;
  return read_all(log, [&](LoggedTick& tick, ReplayReport& report) {
    update_map(map, tick.inputs);
    const StepOutputs& replayed = executive.step(tick.inputs);
    if (report.first_divergence.empty()) {
      const std::string difference = first_difference(tick.outputs, replayed);
      if (!difference.empty()) {
        report.first_divergence =
            fmt::format("t = {:.2f} s: {}", to_seconds(tick.inputs.now), difference);
      }
    }
    return compare(tick, replayed, report);
  });
}

}  // namespace

tl::expected<ReplayReport, std::string> replay(LogReader& log) {
  if (!log.header()) {
    return read_all(log, [](const LoggedTick&, const ReplayReport&) { return false; });
  }
  const tl::expected<Mission, std::string> mission = mission_of(*log.header());
  if (!mission) return tl::unexpected(mission.error());
  const tl::expected<Dived, std::string> dived = dived_of(*log.header(), *mission);
  if (!dived) return tl::unexpected(dived.error());
  Executive executive(*mission, dived->world, dived->model, dived->options);
  return feed(log, executive,
              [](const LoggedTick&, const StepOutputs&, const ReplayReport& report) {
                return report.first_divergence.empty();
              });
}

tl::expected<WhatIf, std::string> replay_with(LogReader& log, const Mission& changed) {
  if (!log.header()) return tl::unexpected(std::string("the log's header is damaged"));
  const tl::expected<Mission, std::string> mission = mission_of(*log.header());
  if (!mission) return tl::unexpected(mission.error());
  tl::expected<Dived, std::string> dived = dived_of(*log.header(), *mission);
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
