#include "mission/record/replay.h"

#include <optional>
#include <utility>

#include <fmt/format.h>

#include "common/diagnostic.h"
#include "common/mathematics.h"
#include "mission/document/mission.h"
#include "mission/executive/behavior_factory.h"
#include "mission/executive/executive.h"
#include "mission/executive/map_updates.h"
#include "mission/record/journal.h"
#include "planning/world/sdf.h"
#include "vehicle/model.h"

namespace dive::mission {
namespace {

tl::unexpected<std::string> unreadable(const char* what, const Diagnostics& diagnostics) {
  const std::string first = diagnostics.list().empty() ? "" : diagnostics.list().front().message;
  return tl::unexpected(fmt::format("its {} is not accepted: {}", what, first));
}

constexpr auto kUnobserved = [](const LoggedTick&, const auto&) {};

tl::expected<Mission, std::string> mission_of(const LogHeader& header) {
  Diagnostics diagnostics;
  std::optional<Mission> mission = parse_mission(
      SourceText(header.mission_name, header.mission_xml), diagnostics, MapFile::kNotNeeded);
  if (!mission) return unreadable("mission", diagnostics);
  return std::move(*mission);
}

tl::expected<planning::World, std::string> world_of(const LogHeader& header,
                                                    planning::MeshSource& meshes) {
  Diagnostics diagnostics;
  std::optional<planning::World> world =
      planning::parse_sdf(SourceText(header.map_name, header.map_xml), diagnostics, meshes);
  if (!world) return unreadable("map", diagnostics);
  return std::move(*world);
}

tl::expected<vehicle::Model, std::string> model_of(const LogHeader& header) {
  Diagnostics diagnostics;
  std::optional<vehicle::Model> model =
      vehicle::parse_urdf(SourceText("vehicle", header.vehicle_urdf), diagnostics);
  if (!model) return unreadable("vehicle", diagnostics);
  return std::move(*model);
}

tl::expected<ExecutiveOptions, std::string> options_of(const LogHeader& header) {
  ExecutiveOptions options;
  options.seed = header.seed;
  if (!header.resume.empty()) {
    tl::expected<Journal, std::string> journal = parse_journal(header.resume);
    if (!journal) return tl::unexpected("its journal is not accepted: " + journal.error());
    if (journal->checkpoint) {
      options.resume = Resume{std::move(*journal->checkpoint), std::move(journal->trail),
                              journal->trail_spacing_m, header.resume_gap_s};
    }
  }
  return options;
}

/// Mission, vehicle and options, and the map if `needs_map`.
tl::expected<LoggedDive, std::string> read_dive(const LogHeader& header, Mission mission,
                                                bool needs_map, planning::MeshSource& meshes) {
  tl::expected<planning::World, std::string> map;
  if (needs_map) map = world_of(header, meshes);
  if (!map) return tl::unexpected(map.error());
  tl::expected<vehicle::Model, std::string> model = model_of(header);
  if (!model) return tl::unexpected(model.error());
  tl::expected<ExecutiveOptions, std::string> options = options_of(header);
  if (!options) return tl::unexpected(options.error());
  return LoggedDive{std::move(mission), std::move(*map), std::move(*model), std::move(*options)};
}

/// Reads the log to its end. `replay_tick` is called for every tick before the first gap, until it
/// returns false; `observe` for every tick afterwards, with true if the tick was replayed and the
/// replay goes on.
template <typename ReplayTick, typename Observe>
ReplayReport read_all(LogReader& log, ReplayTick replay_tick, Observe observe) {
  ReplayReport report;
  if (log.header()) report.logged_mathematics = log.header()->mathematics;
  report.replayed_mathematics = mathematics();
  bool going = true;
  while (std::optional<LoggedTick> tick = log.next()) {
    ++report.ticks;
    going = going && log.gaps().empty();
    if (going) {
      ++report.replayed;
      going = replay_tick(*tick, report);
    }
    observe(*tick, going);
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
/// and stops the replay by returning false. `observe` is called for every tick of the log.
template <typename Compare, typename Observe>
ReplayReport feed(LogReader& log, Executive& executive, Compare compare, Observe observe) {
  planning::ObservedMap map;
  return read_all(
      log,
      [&](LoggedTick& tick, ReplayReport& report) {
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
      },
      observe);
}

}  // namespace

tl::expected<LoggedDive, std::string> logged_dive(const LogHeader& header) {
  planning::MeshBundle meshes(header.map_meshes);
  return logged_dive(header, meshes);
}

tl::expected<LoggedDive, std::string> logged_dive(const LogHeader& header,
                                                  planning::MeshSource& meshes) {
  tl::expected<Mission, std::string> mission = mission_of(header);
  if (!mission) return tl::unexpected(mission.error());
  // Without a world to simulate there is no map in the log either.
  const bool has_map = !header.map_xml.empty();
  return read_dive(header, std::move(*mission), has_map, meshes);
}

ReplayReport replay(LogReader& log, const LoggedDive& dive, const ReplayObserver& observer) {
  const planning::World known = known_world(dive.mission, dive.map);
  Executive executive(dive.mission, known, dive.model, dive.options);
  return feed(
      log, executive,
      [](const LoggedTick&, const StepOutputs&, const ReplayReport& report) {
        return report.first_divergence.empty();
      },
      [&](const LoggedTick& tick, bool is_replayed) {
        observer(tick, is_replayed ? &executive : nullptr);
      });
}

tl::expected<ReplayReport, std::string> replay(LogReader& log) {
  if (!log.header()) {
    return read_all(
        log, [](const LoggedTick&, const ReplayReport&) { return false; }, kUnobserved);
  }
  tl::expected<Mission, std::string> mission = mission_of(*log.header());
  if (!mission) return tl::unexpected(mission.error());
  // The vehicle had no map of an unknown environment.
  const bool had_map = !mission->unknown;
  planning::MeshBundle meshes(log.header()->map_meshes);
  const tl::expected<LoggedDive, std::string> dive =
      read_dive(*log.header(), std::move(*mission), had_map, meshes);
  if (!dive) return tl::unexpected(dive.error());
  return replay(log, *dive, kUnobserved);
}

tl::expected<WhatIf, std::string> replay_with(LogReader& log, const Mission& changed) {
  if (!log.header()) return tl::unexpected(std::string("the log's header is damaged"));
  tl::expected<Mission, std::string> mission = mission_of(*log.header());
  if (!mission) return tl::unexpected(mission.error());
  const bool had_map = !mission->unknown;
  planning::MeshBundle meshes(log.header()->map_meshes);
  const tl::expected<LoggedDive, std::string> dived =
      read_dive(*log.header(), std::move(*mission), had_map, meshes);
  if (!dived) return tl::unexpected(dived.error());
  if (dived->options.resume) {
    return tl::unexpected(std::string(
        "this dive went on from another one: its states may not be those of a changed mission"));
  }
  Executive executive(changed, dived->map, dived->model, dived->options);
  WhatIf what_if;
  what_if.report = feed(
      log, executive,
      [&](const LoggedTick& tick, const StepOutputs& outputs, const ReplayReport&) {
        const double t_s = to_seconds(tick.inputs.now);
        for (const TransitionRecord& record : tick.outputs.transitions) {
          what_if.logged.push_back({t_s, record});
        }
        for (const TransitionRecord& record : outputs.transitions) {
          what_if.replayed.push_back({t_s, record});
        }
        return true;
      },
      kUnobserved);
  return what_if;
}

}  // namespace dive::mission
