#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/bundle_file.h"
#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/terminal.h"
#include "mission/cli/work_progress.h"
#include "mission/record/replay.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;

void print_report(const std::string& log, const ReplayReport& report) {
  const char* verdict = report.identical                         ? "identical"
                        : !report.first_divergence.empty()       ? "DIVERGES"
                        : !report.mathematics_difference.empty() ? "OTHER MATHEMATICS"
                        : !report.gaps.empty()                   ? "DAMAGED"
                                                                 : "EMPTY";
  print(fmt::format("{}: {} ({} ticks, {} events{})", log, verdict, report.ticks, report.events,
                    report.torn ? ", the log ends within a tick" : ""));
  if (!report.first_divergence.empty()) print("  first at " + report.first_divergence);
  if (!report.mathematics_difference.empty()) {
    print(
        fmt::format("  the log was made with mathematics {}, this program has {}; so the log can "
                    "be verified only by a program with the former",
                    report.logged_mathematics, report.replayed_mathematics));
    print("  first difference at " + report.mathematics_difference);
  }
  for (const LogGap& gap : report.gaps) {
    const std::string to =
        gap.to ? fmt::format("to {:.2f} s", to_seconds(*gap.to)) : std::string("to the end");
    print(fmt::format("  gap from {:.2f} s {}: {} bytes at offset {} are damaged or missing",
                      to_seconds(gap.from), to, gap.bytes, gap.offset));
  }
  if (report.replayed < report.ticks && report.first_divergence.empty() &&
      report.mathematics_difference.empty()) {
    print(fmt::format("  {} ticks before the first gap are identical, {} after it were not re-run",
                      report.replayed, report.ticks - report.replayed));
  }
}

int exit_status(const ReplayReport& report) {
  if (!report.mathematics_difference.empty()) return kExitUsage;
  return report.identical ? kExitSuccess : kExitFailed;
}

std::string in_words(const TimedTransition& transition) {
  const TransitionRecord& record = transition.record;
  return fmt::format("{:8.2f} s  {}{}{}", transition.t_s, record.from,
                     record.from.empty() ? "" : " -> ",
                     record.to + (record.cause.empty() ? "" : " (" + record.cause + ")"));
}

int print_what_if(const ReplayArguments& arguments, LogReader& log) {
  Diagnostics diagnostics;
  const std::optional<Mission> mission = load_mission_or_bundle(arguments.mission, diagnostics);
  if (!mission) {
    print_diagnostics(diagnostics);
    return kExitUsage;
  }
  const tl::expected<WhatIf, std::string> what_if = replay_with(log, *mission);
  if (!what_if) {
    complain(fmt::format("{}: {}", arguments.log, what_if.error()));
    return kExitUsage;
  }
  if (arguments.json) {
    Json json = to_json(what_if->report);
    json["logged"] = to_json(what_if->logged);
    json["replayed"] = to_json(what_if->replayed);
    print_json(json);
  } else {
    print_report(arguments.log, what_if->report);
    const auto same = [](const TimedTransition& a, const TimedTransition& b) {
      return in_words(a) == in_words(b);
    };
    const auto [logged, replayed] =
        std::mismatch(what_if->logged.begin(), what_if->logged.end(), what_if->replayed.begin(),
                      what_if->replayed.end(), same);
    for (auto it = what_if->logged.begin(); it != logged; ++it) print("    " + in_words(*it));
    for (auto it = logged; it != what_if->logged.end(); ++it) print("  - " + in_words(*it));
    for (auto it = replayed; it != what_if->replayed.end(); ++it) print("  + " + in_words(*it));
  }
  return exit_status(what_if->report);
}

}  // namespace

int run_replay(const ReplayArguments& arguments) {
  std::optional<LogReader> log = open_log(arguments.log);
  if (!log) return kExitUsage;
  SteadyClock clock;
  WorkProgress progress(clock, "replaying", arguments.json);
  log->observe([&](double share) { progress.show(share); });
  if (!arguments.mission.empty()) return print_what_if(arguments, *log);
  const tl::expected<ReplayReport, std::string> report = replay(*log);
  if (!report) {
    complain(fmt::format("{}: {}", arguments.log, report.error()));
    return kExitUsage;
  }
  if (arguments.json) {
    print_json(to_json(*report));
  } else {
    print_report(arguments.log, *report);
  }
  return exit_status(*report);
}

}  // namespace dive::mission
