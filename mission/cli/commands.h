#pragma once
// The sub-commands of `dive`. Each returns the exit status: 0 success, 1 a negative result: the
// mission or test failed, the dive was aborted, or the files differ, 2 wrong usage or invalid
// input, 3 an internal error or a result that could not be written, 4 the vehicle's dive has not
// ended (`dive run --lcm`), 128 + N a second signal N ended the process.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/operator_command.h"
#include "vehicle/command_timing.h"

namespace dive::mission {

enum ExitStatus : int {
  kExitSuccess = 0,
  kExitFailed = 1,
  kExitUsage = 2,
  kExitInternal = 3,
  kExitUnfinished = 4
};

struct CheckArguments {
  std::string mission;
  bool json = false;
  bool static_only = false;     ///< Skip the simulated dives.
  std::optional<int> dives;     ///< Number of simulated dives; absent: by time.
  bool faults = false;          ///< Every fault in every state.
  bool pairs = false;           ///< Every pair of faults in every state.
  std::optional<int> instants;  ///< Instants of each fault in each state; absent: 3, of pairs 1.
  int jobs = 0;                 ///< Parallel dives; 0: one for each core.
  bool sarif = false;           ///< SARIF on stdout instead of anything else.
  bool list_rules = false;
  std::uint64_t seed = 1;
  std::vector<std::string> conditions;  ///< NAME=VALUE
  std::string vehicle;                  ///< Description of the vehicle; empty: the Aqua2's.
  bool allow_outside = false;           ///< Read meshes outside of the map's folder.
  std::string card;                     ///< The dive card (HTML); empty: none.
  std::string bundle;                   ///< The verified bundle; empty: none.
  std::string key;                      ///< Key file for the bundle's code; empty: no code.
  bool force = false;                   ///< Replace results that exist.
};

struct PlanArguments {
  std::string mission;  ///< A mission, or a map or cloud with start and goal.
  std::string map;
  std::string cloud;
  std::string unit;  ///< Unit of the cloud; empty: guessed.
  std::string start;
  std::string goal;
  double clearance_m = 0.6;
  std::optional<double> max_depth_m;  ///< Default on a map: 50; in a cloud: below all points.
  std::string attitude = "free";
  bool allow_reduced = false;  ///< Accept a reduced path of any clearance.
  bool json = false;
  std::string svg;
  std::uint64_t seed = 1;
  bool force = false;          ///< Replace results that exist.
  bool allow_outside = false;  ///< Read meshes outside of the map's folder.
};

/// Common arguments of the commands that use LCM.
struct LinkArguments {
  std::string url;
  std::string key;        ///< File of the key that all processes of a dive share.
  bool insecure = false;  ///< Packets may leave the machine without a key.
  bool lockstep = false;
  double time_factor = 1.0;  ///< Factor on real time.
};

struct RunArguments {
  std::string mission;     ///< A mission, or a verified bundle.
  bool unchecked = false;  ///< Dive without verification.
  std::string vehicle;     ///< Description of the vehicle; empty: the Aqua2's.
  bool json = false;
  std::uint64_t seed = 1;
  std::string log;      ///< Empty: an automatic name in dive-runs/.
  std::string journal;  ///< Empty: beside the log.
  bool resume = false;
  std::string svg;
  std::string record;           ///< Folder of the dataset; empty: none.
  std::string simulated_water;  ///< Simulated water type; empty: the mission's.
  double leak_at_s = -1.0;
  std::vector<std::string> faults;      ///< NAME@SECONDS
  std::vector<std::string> conditions;  ///< NAME=VALUE
  std::string diver;                    ///< SECONDS:X,Y,Z[:X,Y,Z...]
  LinkArguments link;                   ///< No URL: the built-in simulator.
  std::string cameras;  ///< Folder of the cameras' calibration; empty: the simulated cameras.
  bool stats = false;   ///< Print the timing of the control loop.
  bool force = false;   ///< Replace results that exist.
  bool allow_outside = false;  ///< Read meshes outside of the map's folder.
};

struct SimArguments {
  std::string mission;  ///< A mission, or a map if `start` is given.
  std::string start;
  bool json = false;
  std::uint64_t seed = 1;
  std::vector<std::string> faults;      ///< NAME@SECONDS
  std::vector<std::string> conditions;  ///< NAME=VALUE
  double max_seconds = 3600.0;
  std::string clock_jump;       ///< BY@AT, s: the jump and its time.
  std::string driver_restart;   ///< AWAY@AT, s: duration and time of a restart of the driver.
  bool range_camera = false;    ///< Send scans; always on in an unknown environment.
  std::string simulated_water;  ///< Send images; always on for a visual-inertial mission.
  /// Folder for the calibration of its cameras; then nothing else is done.
  std::string calibration;
  LinkArguments link;
  bool force = false;          ///< Replace results that exist.
  bool allow_outside = false;  ///< Read meshes outside of the map's folder.
};

struct SuperviseArguments {
  std::string mission;  ///< A mission, or a verified bundle; empty: no map fixes.
  std::string vehicle;  ///< Description of the vehicle; empty: the bundle's, or the Aqua2's.
  double command_timeout_s = to_seconds(vehicle::kCommandTimeout);
  bool allow_outside = false;  ///< Read meshes outside of the map's folder.
  bool json = false;
  LinkArguments link;
};

struct NewArguments {
  std::string kind;  ///< transect, penetration or goals
  std::string file;  ///< Mission file; empty: KIND.xml. Its map lies beside it.
  bool json = false;
  bool force = false;  ///< Replace results that exist.
};

struct LspArguments {
  bool stdio = false;  ///< Has no effect: editors add it.
};

struct GenerateArguments {
  std::string folder;
  bool json = false;
  bool force = false;  ///< Replace results that exist.
};

struct KeyArguments {
  std::string path;
  bool json = false;
  bool force = false;  ///< Replace a key that exists.
};

struct TopsideArguments {
  std::optional<OperatorCommand> command;  ///< Empty: status.
  double timeout_s = 5.0;
  bool json = false;
  LinkArguments link;
};

struct TestArguments {
  std::vector<std::string> scenarios;  ///< Files, or folders of files.
  bool json = false;
  bool negate = false;           ///< Negate every expectation; each must then fail.
  bool disable_scripts = false;  ///< Disable scripts: scenarios with a script must then fail.
  bool list_rules = false;
  int jobs = 0;                ///< Parallel dives; 0: one for each core.
  std::string junit;           ///< Empty: none.
  std::string keep;            ///< Folder for logs; empty: none are kept.
  bool keep_all = false;       ///< Keep the logs of passed scenarios too.
  bool force = false;          ///< Replace results that exist.
  bool allow_outside = false;  ///< Read meshes outside of the map's folder.
};

struct ReplayArguments {
  std::string log;
  std::string mission;  ///< Empty: the mission in the log.
  bool json = false;
};

struct DiffArguments {
  std::string a;  ///< Two missions or bundles, two plans, or two logs.
  std::string b;
  std::uint64_t seed = 1;
  bool json = false;
  bool allow_outside = false;  ///< Read meshes outside of the map's folder.
};

struct ExplainArguments {
  std::string log;
  bool json = false;
};

struct ReportArguments {
  std::string file;    ///< A log, or a mission whose legs are planned.
  std::string output;  ///< The HTML file.
  std::uint64_t seed = 1;
  bool json = false;
  bool force = false;          ///< Replace results that exist.
  bool allow_outside = false;  ///< Read meshes outside of the map's folder.
};

struct GraphArguments {
  std::string mission;
  std::string format = "dot";  ///< dot or scxml
  std::string output;          ///< Empty: stdout.
  bool json = false;
  bool force = false;  ///< Replace results that exist.
};

struct ImportArguments {
  std::string format;  ///< acfr or qgc
  std::string file;
  std::string output = ".";
  std::optional<double> speed;  ///< m/s
  double seabed_m = 0.0;
  std::optional<double> depth_m;
  bool json = false;
  bool force = false;  ///< Replace results that exist.
};

struct ExportArguments {
  std::string file;    ///< A mission, a log, a map or a point cloud.
  std::string format;  ///< One of format_names().
  std::string output;  ///< Empty: named after the file, in the working folder.
  std::uint64_t seed = 1;
  bool json = false;
  bool force = false;          ///< Replace results that exist.
  bool allow_outside = false;  ///< Read meshes outside of the map's folder.
};

struct FitArguments {
  std::vector<std::string> logs;
  std::vector<std::string> validate;  ///< Logs that are not fitted; none: each dive in turn.
  std::string output;                 ///< The vehicle's description; empty: none.
  bool json = false;
  bool force = false;  ///< Replace results that exist.
};

struct EstimateArguments {
  std::string folder;                         ///< Or a bag.
  std::vector<std::string> calibration;       ///< Of a bag.
  std::string preset;                         ///< Of a bag; empty: none.
  std::vector<std::string> topics;            ///< "ROLE=NAME", of a bag.
  std::string estimator = "visual_inertial";  ///< visual_inertial or primitive
  std::string init = "images";                ///< "images" or "truth"
  bool mono = false;
  bool no_depth = false;
  bool loops = false;
  std::optional<double> speed;
  std::uint64_t seed = 1;
  std::string against;  ///< Another estimator's trajectory (TUM); empty: none.
  std::string output;   ///< Empty: none.
  bool json = false;
  bool force = false;  ///< Replace results that exist.
};

struct CommandTable;

/// Writes a commented mission and its map.
[[nodiscard]] int run_new(const NewArguments& arguments);
/// Writes man pages and completions of all commands, and the reference of the mission language.
[[nodiscard]] int run_generate(const GenerateArguments& arguments, const CommandTable& table);
/// Serves an editor on standard input and output until it says `exit`.
[[nodiscard]] int run_lsp();
[[nodiscard]] int run_check(const CheckArguments& arguments);
[[nodiscard]] int run_plan(const PlanArguments& arguments);
[[nodiscard]] int run_dive(const RunArguments& arguments);
[[nodiscard]] int run_sim(const SimArguments& arguments);
[[nodiscard]] int run_supervise(const SuperviseArguments& arguments);
[[nodiscard]] int run_topside(const TopsideArguments& arguments);
/// Generates a key and writes it to the file.
[[nodiscard]] int run_key(const KeyArguments& arguments);
/// Exit status 0: equal, 1: different, 2: unreadable, or not of one kind.
[[nodiscard]] int run_diff(const DiffArguments& arguments);
[[nodiscard]] int run_explain(const ExplainArguments& arguments);
[[nodiscard]] int run_report(const ReportArguments& arguments);
[[nodiscard]] int run_graph(const GraphArguments& arguments);
[[nodiscard]] int run_import(const ImportArguments& arguments);
[[nodiscard]] int run_export(const ExportArguments& arguments);
[[nodiscard]] int run_fit(const FitArguments& arguments);
[[nodiscard]] int run_estimate(const EstimateArguments& arguments);
[[nodiscard]] int run_tests(const TestArguments& arguments);
[[nodiscard]] int run_replay(const ReplayArguments& arguments);

}  // namespace dive::mission
