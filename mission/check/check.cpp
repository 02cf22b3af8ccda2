#include "mission/check/check.h"

#include <array>

#include <fmt/format.h>

#include "mission/check/fence.h"
#include "mission/check/reproduce.h"
#include "mission/check/rules.h"
#include "mission/document/state_index.h"
#include "planning/world/overhead.h"
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
    Rule{"CHK-DIVE", Severity::kError, "The simulated dive ends as planned, without a collision."},
    Rule{"CHK-DIVE-CLEARANCE", Severity::kWarning,
         "The simulated dive keeps at least half of the required clearance."},
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

void report_dive(const DiveResult& dive, const Mission& mission, const DiveSettings& settings,
                 Diagnostics& diagnostics) {
  if (dive.outcome != "success") {
    diagnostics.error("CHK-DIVE", mission.source, mission.initial.span,
                      fmt::format("the simulated dive ended in {} ({}): {}", dive.final_state,
                                  dive.outcome, dive.cause),
                      hint_for(mission, settings));
  }
  const Located<double>& asked = mission.limits.clearance;
  if (dive.collisions.empty() && dive.nearest.clearance_m < 0.5 * asked.value) {
    diagnostics.warning("CHK-DIVE-CLEARANCE", mission.source, asked.span,
                        fmt::format("the simulated dive passes {}, less than half of the "
                                    "required clearance ({:g} m)",
                                    describe(dive.nearest), asked.value),
                        hint_for(mission, settings));
  }
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

// Period of progress reports to the observer, s of dive time.
constexpr double kDiveProgressPeriod = 1.0;

NominalDive dive_nominally(const Mission& mission, const planning::World& world,
                           const vehicle::Model& model, const DiveSettings& settings,
                           double expected_s, CheckObserver& observer) {
  NominalDive nominal;
  planning::OverheadIndex overheads(world);
  const double radius = model.hull.radius();
  double next_s = kDiveProgressPeriod;
  nominal.under_overhead.push_back(false);  // tick 0 is before the first step
  nominal.result =
      simulate_dive(mission, world, model, settings,
                    [&](const StepInputs& inputs, const StepOutputs&,
                        const vehicle::GroundTruth& truth, const TickContacts&) {
                      nominal.under_overhead.push_back(overheads.is_above(truth.X_WB.p, radius));
                      const double now_s = to_seconds(inputs.now);
                      if (now_s < next_s) return;
                      next_s += kDiveProgressPeriod;
                      observer.on_progress(now_s, expected_s, "s of the dive", now_s / expected_s);
                    });
  return nominal;
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
                          Diagnostics& diagnostics, CheckObserver& observer) {
  CheckReport report;
  report_unknown(mission, diagnostics);
  observer.on_step("checking the mission against its map");
  check_against_world(mission, world, model.hull, diagnostics);
  if (!diagnostics.ok()) return report;

  const planning::Scene scene(world);
  const Route route = nominal_route(mission, scene);
  observer.on_step(fmt::format("planning {} legs", route.legs.size()));
  report.legs = plan_route(route, world, model.hull, options.dive.planner, options.dive.seed);
  report_failed_plans(route, report.legs, mission, diagnostics);
  if (!diagnostics.ok()) return report;

  observer.on_step("proving the exit paths");
  report.exit_path =
      prove_exit_path(route, report.legs, mission, world, model.hull, options.dive.planner.certify);
  report_exit_path(report.exit_path, mission, diagnostics);
  report.budget = make_budget(route, report.legs, mission, world, model.hull.radius(),
                              report.exit_path, options.dive.conditions);
  check_fence(report.legs, route, mission, model.hull.radius(), diagnostics);
  check_budget(report.budget, report.exit_path, mission, options.dive.conditions, diagnostics);
  if (!options.simulate || !diagnostics.ok() || !has_simulation_map(mission)) return report;

  observer.on_step("simulated dive");
  NominalDive nominal =
      dive_nominally(mission, world, model, options.dive, report.budget.duration_s, observer);
  report_dive(nominal.result, mission, options.dive, diagnostics);
  if (options.faults && diagnostics.ok()) {
    report.faults = dive_faults(nominal, mission, world, model, options, observer);
    report_faults(report.faults, mission, options.dive, diagnostics);
  }
  report.dive = std::move(nominal.result);
  return report;
}

}  // namespace dive::mission
