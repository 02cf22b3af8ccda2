#include <exception>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "mission/cli/command_table.h"
#include "mission/cli/commands.h"
#include "mission/cli/help_formatter.h"
#include "mission/cli/options.h"
#include "mission/cli/terminal.h"
#include "mission/cli/usage_error.h"
#include "vehicle/link/bus.h"

namespace dive::mission {
namespace {

int explain(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
    return app.exit(error) == 0 ? kExitSuccess : kExitUsage;  // --help, --version
  }
  const std::vector<std::string> words(argv + 1, argv + argc);
  complain(describe_usage_error(app, error, words));
  note("Try 'dive --help' or 'dive COMMAND --help'.");
  return kExitUsage;
}

struct Arguments {
  CheckArguments check;
  PlanArguments plan;
  RunArguments run;
  ReplayArguments replay;
  DiffArguments diff;
  ExplainArguments explain;
  ReportArguments report;
  GraphArguments graph;
  ImportArguments import;
  ExportArguments exported;
  FitArguments fit;
  EstimateArguments estimate;
  SimArguments sim;
  SuperviseArguments supervise;
  TopsideArguments topside;
  KeyArguments key;
  TestArguments test;
  NewArguments new_mission;
  LspArguments lsp;
  GenerateArguments generate;
};

void add_commands(CLI::App& app, Arguments& arguments) {
  arguments.sim.link.url = arguments.supervise.link.url = arguments.topside.link.url =
      link::kDefaultUrl;
  add_new(app, arguments.new_mission);
  add_check(app, arguments.check);
  add_plan(app, arguments.plan);
  add_run(app, arguments.run);
  add_replay(app, arguments.replay);
  add_diff(app, arguments.diff);
  add_explain(app, arguments.explain);
  add_report(app, arguments.report);
  add_graph(app, arguments.graph);
  add_import(app, arguments.import);
  add_export(app, arguments.exported);
  add_fit(app, arguments.fit);
  add_estimate(app, arguments.estimate);
  add_sim(app, arguments.sim);
  add_supervise(app, arguments.supervise);
  add_topside(app, arguments.topside);
  add_new_key(app, arguments.key);
  add_test(app, arguments.test);
  add_lsp(app, arguments.lsp);
  add_generate(app, arguments.generate);
}

int run_selected(const CLI::App& app, const Arguments& arguments) {
  if (app.got_subcommand("check")) {
    if (arguments.check.mission.empty() && !arguments.check.list_rules) {
      complain("check needs a mission file");
      return kExitUsage;
    }
    return run_check(arguments.check);
  }
  if (app.got_subcommand("new")) return run_new(arguments.new_mission);
  if (app.got_subcommand("lsp")) return run_lsp();
  if (app.got_subcommand("generate")) {
    return run_generate(arguments.generate, command_table(app, DIVE_VERSION));
  }
  if (app.got_subcommand("plan")) return run_plan(arguments.plan);
  if (app.got_subcommand("run")) return run_dive(arguments.run);
  if (app.got_subcommand("diff")) return run_diff(arguments.diff);
  if (app.got_subcommand("explain")) return run_explain(arguments.explain);
  if (app.got_subcommand("report")) return run_report(arguments.report);
  if (app.got_subcommand("graph")) return run_graph(arguments.graph);
  if (app.got_subcommand("import")) return run_import(arguments.import);
  if (app.got_subcommand("export")) return run_export(arguments.exported);
  if (app.got_subcommand("fit")) return run_fit(arguments.fit);
  if (app.got_subcommand("estimate")) return run_estimate(arguments.estimate);
  if (app.got_subcommand("sim")) return run_sim(arguments.sim);
  if (app.got_subcommand("supervise")) return run_supervise(arguments.supervise);
  if (app.got_subcommand("key")) return run_key(arguments.key);
  if (arguments.topside.command || app.got_subcommand("status")) {
    return run_topside(arguments.topside);
  }
  if (app.got_subcommand("test")) {
    if (arguments.test.scenarios.empty() && !arguments.test.list_rules) {
      complain("test needs a scenario file, or a folder of them");
      return kExitUsage;
    }
    return run_tests(arguments.test);
  }
  return run_replay(arguments.replay);
}

int dispatch(int argc, char** argv) {
  CLI::App app(
      "Examples:\n"
      "  dive new transect survey.xml       write a mission to begin with\n"
      "  dive check missions/window.xml     can this mission work?\n"
      "  dive run missions/window.xml       dive it in the simulator\n"
      "  dive replay LOG                    re-run a log, bit for bit\n"
      "  dive report LOG --output F.html    look at the dive in a browser, offline\n"
      "  dive test missions/scenarios       dive scripted scenarios\n\n"
      "Mission executive for the Aqua2 autonomous underwater vehicle.",
      "dive");
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version", std::string("dive ") + DIVE_VERSION);
  app.require_subcommand(1);
  Arguments arguments;
  add_commands(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return explain(app, error, argc, argv);
  }
  return run_selected(app, arguments);
}

}  // namespace
}  // namespace dive::mission

int main(int argc, char** argv) {
  dive::mission::occupy_standard_streams();
  int status = dive::mission::kExitInternal;
  try {
    status = dive::mission::dispatch(argc, argv);
  } catch (const std::exception& error) {
    dive::mission::complain(std::string("internal error: ") + error.what());
  }
  return dive::mission::finish_standard_output(status);
}
