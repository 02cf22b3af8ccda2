#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/parallel.h"
#include "mission/card/card.h"
#include "mission/check/check.h"
#include "mission/check/rules.h"
#include "mission/cli/bundle_file.h"
#include "mission/cli/check_progress.h"
#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/mesh_report.h"
#include "mission/cli/output.h"
#include "mission/cli/plan_legs.h"
#include "mission/cli/terminal.h"
#include "mission/import/foreign_mission.h"
#include "mission/simulation/simulated_conditions.h"
#include "mission/states/state_elements.h"

namespace dive::mission {
namespace {

void print_dives(const DiveSeries& series) {
  const std::uint64_t last = series.first_seed + static_cast<std::uint64_t>(series.dives) - 1;
  const std::string seeds = series.dives == 1
                                ? fmt::format("seed {}", last)
                                : fmt::format("seeds {} to {}", series.first_seed, last);
  print(
      fmt::format("  dives  {} with {}: {} successful, {} surfaced, {} with a collision (at most "
                  "{:.1f} % of dives, with 95 % confidence)",
                  series.dives, seeds, series.successes, series.surfaced, series.collisions,
                  100.0 * series.collision_bound_95));
  print(fmt::format("         clearance {:.2f} m (5th percentile), {:.2f} m (least); the worst: {}",
                    series.clearance_m.p05, series.clearance_m.min,
                    series.worst_first.front().command));
}

// The leg on which a current leaves the least speed over ground.
void print_progress(const CheckReport& report) {
  const LeastProgress* least = nullptr;
  std::string goal;
  for (std::size_t i = 0; i < report.progress.size(); ++i) {
    const auto& progress = report.progress[i];
    if (!progress || (least != nullptr && progress->share >= least->share)) continue;
    least = &*progress;
    goal = report.legs[i].goal;
  }
  constexpr double kHardlySlower = 0.9;
  if (least == nullptr || least->share > kHardlySlower) return;
  print(
      fmt::format("  current at worst {:.2f} m/s over ground, {:.0f} % of the speed ({} {}, after "
                  "{:.0f} s)",
                  least->over_ground, 100.0 * least->share, least->is_way_back ? "back from" : "to",
                  goal, least->elapsed_s));
}

void print_report(const CheckReport& report, bool has_world) {
  for (const PlannedRouteLeg& leg : report.legs) {
    const std::string margin = std::isfinite(leg.margin.margin_sigma)
                                   ? fmt::format(", margin {:.1f} sigma at {}",
                                                 leg.margin.margin_sigma, leg.margin.obstacle_name)
                                   : "";
    const std::string clearance = has_world ? "certified " + certified_text(leg.plan.clearance_m)
                                            : fmt::format("straight line, {}", kNotCertified);
    print(fmt::format("  plan   {:<12} {:6.1f} m, {}, {:.1f} ms, {} warm start(s){}", leg.goal,
                      leg.plan.length_m, clearance, leg.statistics.total_ms, leg.plan.warm_starts,
                      margin));
  }
  print_progress(report);
  print(fmt::format(
      "  abort  longest exit path {:.1f} m and {:.0f} s (in {}), {}", report.exit_path.longest_m,
      report.exit_path.longest_s, report.exit_path.state,
      has_world ? "certified " + certified_text(report.exit_path.clearance_m) : kNotCertified));
  const Budget& budget = report.budget;
  print(fmt::format("  budget {:.1f} m, {:.0f} s, {:.1f} Wh; at worst {:.0f} s and {:.1f} Wh",
                    budget.distance_m, budget.duration_s, budget.energy_wh, budget.worst_duration_s,
                    budget.worst_energy_wh));
  if (const auto turn = budget.first_turning_point()) {
    print(fmt::format("  turn   back after {:.0f} s or at {:.0f} % of the charge at the latest",
                      turn->latest_s, 100.0 * turn->least_charge));
  }
  if (budget.budget_used_under_overhead > 0.0) {
    print(
        fmt::format("  thirds {:.0f} % of the usable time or charge used under the overhead "
                    "before the return begins (in {})",
                    100.0 * budget.budget_used_under_overhead, budget.worst_overhead_state));
  }
  if (report.dive) {
    const DiveResult& dive = *report.dive;
    print(fmt::format("  dive   {} in state {} after {:.0f} s, {} collision(s)", dive.outcome,
                      dive.final_state, dive.duration_s, dive.collisions.size()));
    print_contacts(dive.nearest, dive.collisions);
  }
  if (report.dives) print_dives(*report.dives);
  if (!report.faults.empty()) {
    const auto count = [&](bool FaultResult::*how) {
      return std::ranges::count_if(report.faults,
                                   [how](const FaultResult& result) { return result.*how; });
    };
    print(fmt::format("  faults {} dives: {} surfaced, {} held to the end, no collision",
                      report.faults.size(), count(&FaultResult::surfaced),
                      count(&FaultResult::held)));
  }
}

CheckOptions options_of(const CheckArguments& arguments) {
  CheckOptions options;
  options.simulate = !arguments.static_only;
  options.dives = arguments.dives;
  options.faults = arguments.faults || arguments.pairs;
  options.instants = arguments.instants.value_or(options.instants);
  if (arguments.pairs) options.pair_instants = arguments.instants.value_or(1);
  options.fault_current = std::ranges::any_of(arguments.conditions, [](const std::string& each) {
    return each.starts_with("current_sigma=");
  });
  options.threads = thread_count(arguments.jobs);
  options.dive.seed = arguments.seed;
  options.dive.vehicle_path = arguments.vehicle;
  return options;
}

void print_result(const CheckArguments& arguments, const std::optional<LoadedMission>& loaded,
                  const CheckReport& report, const Diagnostics& diagnostics) {
  if (arguments.sarif) {
    print_json(to_sarif(diagnostics, all_rules()));
    return;
  }
  if (arguments.json) {
    nlohmann::ordered_json json = to_json(report, diagnostics);
    json["meshes"] = meshes_json(loaded ? loaded->world : planning::World{});
    if (!arguments.card.empty()) {
      json["card"] = diagnostics.ok() ? nlohmann::ordered_json(arguments.card) : nullptr;
    }
    if (!arguments.bundle.empty()) {
      json["bundle"] = diagnostics.ok() ? nlohmann::ordered_json(arguments.bundle) : nullptr;
    }
    print_json(json);
    return;
  }
  print_diagnostics(diagnostics);
  if (diagnostics.ok()) {
    print(fmt::format("{}: ok", arguments.mission));
    print_report(report, has_simulation_map(loaded->mission));
    if (!arguments.card.empty()) print(fmt::format("  card   {}", arguments.card));
    if (!arguments.bundle.empty()) {
      print(fmt::format("  bundle {}{}", arguments.bundle,
                        arguments.key.empty() ? "" : ", code made with " + arguments.key));
    }
  } else {
    print(fmt::format("{}: not ready to dive", arguments.mission));
    if (report.dives) print_dives(*report.dives);
  }
  if (loaded) print_meshes(loaded->world);
}

// Writes the card of a mission that is ready; returns 0 or the exit status.
int write_card(Result& card, const CheckArguments& arguments,
               const std::optional<LoadedMission>& loaded, const CheckReport& report,
               const Diagnostics& diagnostics) {
  if (!card || !loaded) return kExitSuccess;
  if (!diagnostics.ok()) {
    note(fmt::format("dive: {}: no card is written, because the mission is not ready to dive",
                     arguments.card));
    return kExitSuccess;
  }
  return write_result(card,
                      render_card({loaded->mission, report, diagnostics, loaded->map.content(),
                                   loaded->vehicle.content(), DIVE_VERSION}));
}

// Opens card and bundle; returns 0 or the exit status.
int open_results(const CheckArguments& arguments, Result& card, Result& bundle) {
  for (auto [path, result] : {std::pair(&arguments.card, &card), {&arguments.bundle, &bundle}}) {
    tl::expected<Result, int> opened = open_result(*path, arguments.force);
    if (!opened) return opened.error();
    if (*opened) result->emplace(std::move(**opened));
  }
  return kExitSuccess;
}

}  // namespace

int run_check(const CheckArguments& arguments) {
  if (arguments.list_rules) {
    print_rules(
        {document_rules(), map_rules(), world_rules(), state_rules(), deck_rules(), import_rules()},
        arguments.json);
    return kExitSuccess;
  }
  if (arguments.static_only && arguments.dives) {
    complain("--static skips simulated dives: leave out --dives, or --static");
    return kExitUsage;
  }
  if (!arguments.key.empty() && arguments.bundle.empty()) {
    complain("--key makes the code of a bundle: give --bundle FILE as well");
    return kExitUsage;
  }
  const tl::expected<std::optional<link::Key>, int> key = key_of(arguments.key);
  if (!key) return key.error();
  Diagnostics diagnostics;
  CheckReport report;
  Result card;
  Result bundle;
  const std::optional<LoadedMission> loaded =
      load(arguments.mission, resources(arguments.allow_outside), diagnostics, arguments.vehicle);
  if (loaded) {
    CheckOptions options = options_of(arguments);
    const std::optional<vehicle::Conditions> conditions =
        parse_conditions(arguments.conditions, simulated_conditions(loaded->mission));
    if (!conditions) return kExitUsage;
    options.dive.conditions = *conditions;
    options.dive.world = loaded->simulated_world;
    if (const int status = open_results(arguments, card, bundle)) return status;
    SteadyClock clock;
    CheckProgress progress(clock, arguments.json || arguments.sarif);
    report = check_mission(loaded->mission, loaded->world, loaded->model, options, diagnostics,
                           progress, clock);
  }
  diagnostics.sort();
  if (const int status = write_card(card, arguments, loaded, report, diagnostics)) return status;
  if (loaded) {
    if (const int status = write_bundle(bundle, arguments, *key, *loaded, report, diagnostics)) {
      return status;
    }
  }
  print_result(arguments, loaded, report, diagnostics);
  if (diagnostics.ok()) return kExitSuccess;
  // A valid mission that ends badly in simulation has failed; everything else is invalid input.
  return report.dive ? kExitFailed : kExitUsage;
}

}  // namespace dive::mission
