#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/check/route_plan.h"
#include "mission/cli/commands.h"
#include "mission/cli/file_kind.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/cli/work_progress.h"
#include "mission/report/page.h"
#include "mission/report/plan_report.h"
#include "mission/report/read_dive.h"
#include "planning/world/scene.h"

namespace dive::mission {
namespace {

/// A report, and the file that it goes to.
struct Prepared {
  Report report;
  Result result;
};

void warn_of_damage(const std::string& log, const DiveReport& dive) {
  const auto warn = [&](const std::string& what) { note(fmt::format("dive: {}: {}", log, what)); };
  if (!dive.gaps.empty()) warn(fmt::format("the log is damaged: {} gap(s)", dive.gaps.size()));
  if (dive.torn) warn("the log is torn: it ends before the dive did");
  if (!dive.rerun_problem.empty()) {
    warn(fmt::format("exit path, trail and overhead are known until {:.2f} s only: {}",
                     dive.rerun_until_s, dive.rerun_problem));
  }
}

// Both print an error and return the exit status if there is no report.
tl::expected<Prepared, int> prepare_dive(const ReportArguments& arguments) {
  tl::expected<Result, int> result = open_result(arguments.output, arguments.force);
  if (!result) return tl::unexpected(result.error());
  SteadyClock clock;
  WorkProgress progress(clock, "replaying", arguments.json);
  ReadDiveOptions options;
  options.progress = [&](double share) { progress.show(share); };
  tl::expected<Report, std::string> report = read_dive(arguments.file, options);
  if (!report) {
    complain(report.error());
    return tl::unexpected<int>(kExitUsage);
  }
  warn_of_damage(arguments.file, *report->dive);
  return Prepared{std::move(*report), std::move(*result)};
}

tl::expected<Prepared, int> prepare_plan(const ReportArguments& arguments) {
  Diagnostics diagnostics;
  const std::optional<LoadedMission> loaded =
      load(arguments.file, resources(arguments.allow_outside), diagnostics);
  print_diagnostics(diagnostics);
  if (!loaded) return tl::unexpected<int>(kExitUsage);
  tl::expected<Result, int> result = open_result(arguments.output, arguments.force);
  if (!result) return tl::unexpected(result.error());
  const planning::Scene scene(loaded->world);
  const std::vector<PlannedRouteLeg> legs =
      plan_route(nominal_route(loaded->mission, scene), loaded->mission, loaded->world,
                 loaded->model.hull, planning::PlannerOptions{}, arguments.seed);
  return Prepared{report_of_plan(loaded->mission, loaded->map.content(), loaded->world,
                                 loaded->model, legs, arguments.seed),
                  std::move(*result)};
}

tl::expected<Prepared, int> prepare(const ReportArguments& arguments) {
  const FileKind kind = kind_of_file(arguments.file);  // also notes that the file is an input
  switch (kind) {
    case FileKind::kMission:
      return prepare_plan(arguments);
    case FileKind::kLog:
    case FileKind::kUnknown:  // the reader of logs names what is wrong
      return prepare_dive(arguments);
    default:
      complain(fmt::format("{}: this is {}: a report needs a log, or a mission to plan",
                           arguments.file, in_words(kind)));
      return tl::unexpected<int>(kExitUsage);
  }
}

}  // namespace

int run_report(const ReportArguments& arguments) {
  tl::expected<Prepared, int> prepared = prepare(arguments);
  if (!prepared) return prepared.error();
  prepared->report.made_by = DIVE_VERSION;
  const std::string page = render_page(prepared->report);
  if (const int status = write_result(prepared->result, page)) return status;
  if (arguments.json) {
    print_json({{"report", arguments.output}, {"bytes", page.size()}});
  } else {
    print(fmt::format("report {} ({})", arguments.output, rounded_size(page.size())));
  }
  return kExitSuccess;
}

}  // namespace dive::mission
