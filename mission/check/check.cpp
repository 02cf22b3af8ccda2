#include "mission/check/check.h"

#include <array>

#include <fmt/format.h>

#include "mission/check/fence.h"
#include "mission/check/position_margin.h"
#include "mission/check/reproduce.h"
#include "mission/check/rules.h"
#include "mission/document/state_index.h"
#include "planning/world/scene.h"

namespace dive::mission {
namespace {

constexpr std::array kDeckRules = {
    Rule{"CHK-UNKNOWN-ENVIRONMENT", Severity::kWarning,
         "In an unknown environment the checks use the simulated world, which the vehicle does not "
         "have."},
    Rule{"CHK-UNKNOWN-NO-SIMULATION-MAP", Severity::kWarning,
         "A mission in an unknown environment names a simulated world; little can be proved "
         "without."},
    Rule{
        "CHK-PLAN", Severity::kError,
        "Every leg of the nominal route has a path that is certified to keep the clearance, or the "
        "reduced_clearance that the mission accepts where the leg starts."},
    Rule{
        "CHK-MARGIN", Severity::kError,
        "On every leg the clearance, less the follower's tube, is at least 3.5 standard deviations "
        "of the predicted position."},
    Rule{"CHK-MARGIN-SMALL", Severity::kWarning, "The same with 5 standard deviations."},
    Rule{"CHK-NO-FIXES", Severity::kError,
         "Under an overhead fixes or cameras correct the position, or the mission declares still "
         "water."},
    Rule{"CHK-CURRENT", Severity::kError,
         "On every leg a quarter of the speed remains over ground in the declared current and one "
         "standard deviation more, with a crab angle of at most 29 degrees; under an overhead also "
         "in the opposite direction."},
    Rule{"CHK-CURRENT-MARGIN", Severity::kWarning, "The same with half of the speed."},
    Rule{"CHK-CURRENT-TABLE", Severity::kError,
         "The table of the current covers the expected duration."},
    Rule{"CHK-CURRENT-DRIFT", Severity::kWarning,
         "During a hold or a dwell the current carries the vehicle no farther than the clearance."},
    Rule{"CHK-NO-EXIT-PATH", Severity::kError,
         "From every point of the route the trail leads back to open water."},
    Rule{"CHK-RETRACE", Severity::kError, "The route can be followed backwards without contact."},
    Rule{"CHK-TIME", Severity::kError, "The route takes no longer than mission_timeout."},
    Rule{"CHK-TIME-MARGIN", Severity::kWarning,
         "The route and the longest exit path together take no longer than mission_timeout."},
    Rule{"CHK-ENERGY", Severity::kError, "The route leaves battery_reserve in the battery."},
    Rule{"CHK-ENERGY-WORST", Severity::kWarning,
         "The battery lasts until mission_timeout, and then for the longest exit path."},
    Rule{"CHK-NO-RETURN", Severity::kError,
         "From every point of the route, time and charge suffice to leave and surface."},
    Rule{"CHK-THIRDS", Severity::kWarning,
         "A penetration uses at most a third of the usable time and charge before it turns back."},
    Rule{"CHK-FENCE", Severity::kError, "The whole vehicle stays within the geofence."},
    Rule{"CHK-DIVE", Severity::kError, "No simulated dive collides."},
    Rule{"CHK-DIVE-ABORTED", Severity::kError,
         "The first simulated dive and 19 of 20 of them end as planned; fewer others that do not "
         "are a warning."},
    Rule{"CHK-DIVE-CLEARANCE", Severity::kWarning,
         "The 5th percentile of the clearance of the simulated dives is at least half of the "
         "required clearance."},
    Rule{"CHK-FAULT", Severity::kError,
         "After any fault in any state the dive ends surfaced or held, without a collision."},
};

Span map_span(const Mission& mission) { return mission.map_file.span; }

void report_unknown(const Mission& mission, Diagnostics& diagnostics) {
  if (!mission.unknown) return;
  if (has_simulation_map(mission)) {
    diagnostics.warning("CHK-UNKNOWN-ENVIRONMENT", mission.source, map_span(mission),
                        "all proofs are for the simulated world: the vehicle does not have that "
                        "map, and the real environment may differ");
    return;
  }
  diagnostics.warning(
      "CHK-UNKNOWN-NO-SIMULATION-MAP", mission.source, map_span(mission),
      "the environment is unknown and has no simulated world: whether goals are free "
      "and paths to them and out of overheads exist cannot be proved, distances and "
      "budget assume straight paths, and there is no simulated dive",
      "write simulation_map=\"maps/NAME.sdf\" with a world like the expected one");
}

std::string hint_for(const Mission& mission, const DiveSettings& settings) {
  return "reproduce it with: " + run_command_for(mission, settings);
}

DiveSettings settings_of(const FaultResult& result, DiveSettings settings) {
  settings.faults = result.fault.faults;
  return settings;
}

void report_faults(const std::vector<FaultResult>& results, const Mission& mission,
                   const DiveSettings& settings, Diagnostics& diagnostics) {
  for (const FaultResult& result : results) {
    if (result.is_safe()) continue;
    diagnostics.error("CHK-FAULT", mission.source, span_of_state(mission, result.fault.state),
                      describe(result), hint_for(mission, settings_of(result, settings)));
  }
}

std::string describe_series(const std::optional<int>& dives) {
  if (!dives) {
    return fmt::format("simulated dives for {:.0f} s, at least {}", kSeriesSeconds, kMinTimedDives);
  }
  return *dives == 1 ? "simulated dive" : fmt::format("{} simulated dives", *dives);
}

SeriesResult dive_often(const Mission& mission, const planning::World& world,
                        const vehicle::Model& model, const CheckOptions& options, double expected_s,
                        CheckObserver& observer, Clock& clock) {
  observer.on_step(describe_series(options.dives));
  return dive_series(mission, world, model, options.dive,
                     {options.dives, options.threads, expected_s}, clock,
                     [&](double done, double total, const std::string& unit, double share) {
                       observer.on_progress(done, total, unit, share);
                     });
}

CheckOptions fault_options(CheckOptions options) {
  options.dives = 1;
  if (!options.fault_current) options.dive.conditions.current_sigma = 0.0;
  return options;
}

std::vector<FaultResult> dive_faults(const NominalDive& nominal, const Mission& mission,
                                     const planning::World& world, const vehicle::Model& model,
                                     const CheckOptions& options, CheckObserver& observer) {
  const std::vector<FaultCase> cases = draw_fault_cases(
      mission, nominal, {options.dive.seed, options.instants, options.pair_instants});
  observer.on_step(fmt::format("{} simulated dives with faults", cases.size()));
  const auto total = static_cast<double>(cases.size());
  FaultProgress work(cases);
  const auto follow = [&](std::size_t done, const FaultResult& result) {
    work.add(result);
    if (!result.is_safe()) {
      const DiveSettings settings = settings_of(result, options.dive);
      observer.on_finding(result, run_command_for(mission, settings));
    }
    observer.on_progress(static_cast<double>(done), total, "dives", work.share());
  };
  return dive_with_faults(cases, mission, world, model, options.dive, options.threads, follow);
}

}  // namespace

std::span<const Rule> deck_rules() { return kDeckRules; }

CheckReport check_mission(const Mission& mission, const planning::World& world,
                          const vehicle::Model& model, const CheckOptions& options,
                          Diagnostics& diagnostics, CheckObserver& observer, Clock& clock) {
  CheckReport report;
  report_unknown(mission, diagnostics);
  observer.on_step("checking the mission against its map");
  check_against_world(mission, world, model.hull, diagnostics);
  if (!diagnostics.ok()) return report;

  const planning::Scene scene(world);
  const Route route = nominal_route(mission, scene);
  observer.on_step(fmt::format("planning {} legs", route.legs.size()));
  const auto total = static_cast<double>(route.legs.size());
  report.legs = plan_route(route, mission, world, model.hull, options.dive.planner,
                           options.dive.seed, [&](std::size_t planned) {
                             const auto done = static_cast<double>(planned);
                             observer.on_progress(done, total, "legs", done / total);
                           });
  report_failed_plans(route, report.legs, mission, diagnostics);
  if (!diagnostics.ok()) return report;

  report.times = route_times(route, report.legs, mission);
  report.progress = least_progress(route, report.legs, mission, world, model.hull.radius());
  check_current(route, report.legs, report.progress, mission, diagnostics);
  check_dead_reckoning(route, report.legs, mission, world, model.hull, diagnostics);
  if (has_position_margins(mission)) {
    observer.on_step("predicting the position along the legs");
    predict_position_margins(route, report.legs, mission, world, model);
    check_position_margins(route, report.legs, mission, diagnostics);
  }
  observer.on_step("proving the exit paths");
  report.exit_path =
      prove_exit_path(route, report.legs, mission, world, model.hull, options.dive.planner.certify);
  report_exit_path(report.exit_path, mission, diagnostics);
  report.budget = make_budget(route, report.legs, mission, world, model, report.exit_path,
                              options.dive.conditions);
  check_fence(report.legs, route, mission, model.hull.radius(), diagnostics);
  check_budget(report.budget, report.exit_path, mission, options.dive.conditions, diagnostics);
  if (!options.simulate || !diagnostics.ok() || !has_simulation_map(mission)) return report;

  SeriesResult dived =
      dive_often(mission, world, model, options, report.budget.duration_s, observer, clock);
  check_dives(dived.series, mission, diagnostics);
  if (options.faults && diagnostics.ok()) {
    const CheckOptions with_faults = fault_options(options);
    const bool is_dived = with_faults.dive.conditions.current_sigma ==
                          options.dive.conditions.current_sigma;  // as the first one of the series
    std::optional<SeriesResult> without_fault;
    if (!is_dived) {
      without_fault =
          dive_often(mission, world, model, with_faults, report.budget.duration_s, observer, clock);
    }
    report.faults = dive_faults(without_fault ? without_fault->nominal : dived.nominal, mission,
                                world, model, with_faults, observer);
    report_faults(report.faults, mission, with_faults.dive, diagnostics);
  }
  report.dive = std::move(dived.nominal.result);
  report.dives = std::move(dived.series);
  return report;
}

}  // namespace dive::mission
