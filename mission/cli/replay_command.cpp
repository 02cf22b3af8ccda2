#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/terminal.h"
#include "mission/record/replay.h"

namespace dive::mission {

int run_replay(const ReplayArguments& arguments) {
  tl::expected<LogReader, std::string> log = LogReader::open(arguments.log);
  if (!log) {
    complain(fmt::format("{}: {}", arguments.log, log.error()));
    return kExitUsage;
  }
  const tl::expected<ReplayReport, std::string> report = replay(*log);
  if (!report) {
    complain(fmt::format("{}: {}", arguments.log, report.error()));
    return kExitUsage;
  }
  if (arguments.json) {
    print_json(to_json(*report));
  } else {
    print(fmt::format("{}: {} ({} ticks, {} events{})", arguments.log,
                      report->identical ? "identical" : "DIVERGES", report->ticks, report->events,
                      report->torn ? ", the log's tail is torn" : ""));
    if (!report->first_divergence.empty()) print("  first at " + report->first_divergence);
  }
  return report->identical ? kExitSuccess : kExitFailed;
}

}  // namespace dive::mission
