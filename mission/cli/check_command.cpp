#include <algorithm>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/check/check.h"
#include "mission/check/rules.h"
#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/terminal.h"
#include "mission/import/foreign_mission.h"

namespace dive::mission {
namespace {

void print_report(const CheckReport& report) {
  for (const PlannedRouteLeg& leg : report.legs) {
    print(fmt::format("  plan   {:<12} {:6.1f} m, certified {:.2f} m, {:.1f} ms, {} warm start(s)",
                      leg.goal, leg.plan.length_m, leg.plan.clearance_m, leg.plan.times.total_ms,
                      leg.plan.warm_starts));
  }
  print(fmt::format("  abort  longest way out {:.1f} m and {:.0f} s (in {}), certified {:.2f} m",
                    report.way_out.longest_m, report.way_out.longest_s, report.way_out.state,
                    report.way_out.clearance_m));
  const Budget& budget = report.budget;
  print(fmt::format("  budget {:.1f} m, {:.0f} s, {:.1f} Wh; at worst {:.0f} s and {:.1f} Wh",
                    budget.distance_m, budget.duration_s, budget.energy_wh, budget.worst_duration_s,
                    budget.worst_energy_wh));
  if (budget.spent_under > 0.0) {
    print(
        fmt::format("  thirds {:.0f} % of the usable time or charge spent under the overhead "
                    "before the way back begins (in {})",
                    100.0 * budget.spent_under, budget.spent_under_state));
  }
  if (report.dive) {
    const DiveResult& dive = *report.dive;
    print(fmt::format("  dive   {} in state {} after {:.0f} s, nearest {:.2f} m, {} collision(s)",
                      dive.outcome, dive.final_state, dive.duration_s, dive.min_clearance_m,
                      dive.collisions));
  }
  if (!report.faults.empty()) {
    const auto count = [&](bool FaultVerdict::*how) {
      return std::ranges::count_if(report.faults,
                                   [how](const FaultVerdict& verdict) { return verdict.*how; });
    };
    print(fmt::format("  faults {} dives: {} surfaced, {} held, no collision", report.faults.size(),
                      count(&FaultVerdict::surfaced), count(&FaultVerdict::held)));
  }
}

}  // namespace

int run_check(const CheckArguments& arguments) {
  if (arguments.list_rules) {
    print_rules({document_rules(), world_rules(), deck_rules(), import_rules()}, arguments.json);
    return kExitSuccess;
  }
  CheckOptions options;
  options.simulate = !arguments.static_only;
  options.faults = arguments.faults || arguments.pairs;
  options.pairs = arguments.pairs;
  options.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  options.dive.seed = arguments.seed;
  const std::optional<vehicle::Conditions> conditions = parse_conditions(arguments.conditions);
  if (!conditions) return kExitUsage;
  options.dive.conditions = *conditions;

  Diagnostics diagnostics;
  CheckReport report;
  const std::optional<LoadedMission> loaded = load(arguments.mission, diagnostics);
  if (loaded) {
    report = check_mission(loaded->mission, loaded->world, loaded->model, options, diagnostics,
                           [](const std::string& what) { note("check: " + what); });
  }
  diagnostics.sort();
  if (arguments.sarif) {
    print_json(to_sarif(diagnostics, all_rules()));
  } else if (arguments.json) {
    print_json(to_json(report, diagnostics));
  } else {
    print_diagnostics(diagnostics);
    if (diagnostics.ok()) {
      print(fmt::format("{}: ok", arguments.mission));
      print_report(report);
    } else {
      print(fmt::format("{}: not ready to dive", arguments.mission));
    }
  }
  if (diagnostics.ok()) return kExitSuccess;
  // A mission that is well written but ends badly in simulation failed; all else is bad input.
  return report.dive ? kExitFailed : kExitUsage;
}

}  // namespace dive::mission
