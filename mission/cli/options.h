#pragma once
// The options of each sub-command with their help: examples, and one sentence that summarises the
// command. Each function adds its command to `app`; parsing fills `arguments`.

#include <string>

#include "mission/cli/commands.h"

namespace CLI {
class App;
}

namespace dive::mission {

// On deck, and afterwards.
void add_new(CLI::App& app, NewArguments& arguments);
void add_lsp(CLI::App& app, LspArguments& arguments);
void add_check(CLI::App& app, CheckArguments& arguments);
void add_plan(CLI::App& app, PlanArguments& arguments);
void add_test(CLI::App& app, TestArguments& arguments);
void add_graph(CLI::App& app, GraphArguments& arguments);
void add_import(CLI::App& app, ImportArguments& arguments);
void add_replay(CLI::App& app, ReplayArguments& arguments);
void add_diff(CLI::App& app, DiffArguments& arguments);
void add_explain(CLI::App& app, ExplainArguments& arguments);
void add_report(CLI::App& app, ReportArguments& arguments);
void add_export(CLI::App& app, ExportArguments& arguments);
void add_fit(CLI::App& app, FitArguments& arguments);
void add_estimate(CLI::App& app, EstimateArguments& arguments);

// Diving, in the simulator or over LCM.
void add_run(CLI::App& app, RunArguments& arguments);
void add_sim(CLI::App& app, SimArguments& arguments);
void add_supervise(CLI::App& app, SuperviseArguments& arguments);
/// The commands abort, pause, resume, skip and status.
void add_topside(CLI::App& app, TopsideArguments& arguments);
void add_new_key(CLI::App& app, KeyArguments& arguments);

/// For packages: not in the list of commands.
void add_generate(CLI::App& app, GenerateArguments& arguments);

inline constexpr const char* kJsonHelp = "One JSON object on stdout";
inline constexpr const char* kForceHelp = "Replace results that exist";
inline constexpr const char* kOutsideHelp =
    "Also read meshes outside of the map's folder (for a map that you trust)";
inline constexpr const char* kConditionsHelp =
    "Set a condition of simulated dives, e.g. current_x=0.01; a wrong name lists them all";

inline constexpr const char* kVehicleHelp =
    "Description of the vehicle (URDF), as dive fit writes it (default: the Aqua2's)";

}  // namespace dive::mission
