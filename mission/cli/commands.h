#pragma once
// The sub-commands of `dive`. Each returns the exit status: 0 success, 1 the mission failed or was
// aborted, 2 wrong usage or invalid input, 3 an internal error.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace dive::mission {

enum ExitStatus : int { kExitSuccess = 0, kExitFailed = 1, kExitUsage = 2, kExitInternal = 3 };

struct CheckArguments {
  std::string mission;
  bool json = false;
  bool static_only = false;  ///< No simulated dive.
  bool faults = false;       ///< Every fault in every state ...
  bool pairs = false;        ///< ... and every two.
  bool sarif = false;        ///< SARIF on stdout instead of anything else.
  bool list_rules = false;
  std::uint64_t seed = 1;
  std::vector<std::string> conditions;  ///< NAME=VALUE
};

struct PlanArguments {
  std::string mission;  ///< Or map or cloud, start and goal.
  std::string map;
  std::string cloud;
  std::string unit;  ///< Of the cloud; empty: as it looks.
  std::string start;
  std::string goal;
  double clearance_m = 0.6;
  std::optional<double> max_depth_m;  ///< On a map 50 if not said, in a cloud below all of it.
  std::string attitude = "free";
  bool json = false;
  std::string svg;
  std::uint64_t seed = 1;
};

/// Of everything that speaks LCM.
struct LinkArguments {
  std::string url;
  std::string key;  ///< File of the key that topside and executive share.
  bool lockstep = false;
  double speed = 1.0;  ///< Times real time.
};

struct RunArguments {
  std::string mission;
  bool json = false;
  std::uint64_t seed = 1;
  std::string log;      ///< Empty: a name of its own in dive-runs/.
  std::string journal;  ///< Empty: beside the log.
  bool resume = false;
  std::string svg;
  std::string record;  ///< A folder for a dataset; empty: none.
  std::string water;   ///< That the cameras see through; empty: the mission's.
  double leak_at_s = -1.0;
  std::vector<std::string> faults;      ///< NAME@SECONDS
  std::vector<std::string> conditions;  ///< NAME=VALUE
  std::string diver;                    ///< SECONDS:X,Y,Z:X,Y,Z...
  LinkArguments link;                   ///< No URL: the built-in simulator.
  std::string cameras;                  ///< A folder with their calibration; empty: the simulated.
  bool stats = false;                   ///< How the control loop kept time.
};

struct SimArguments {
  std::string mission;  ///< Or, with `start`, a map.
  std::string start;
  bool json = false;
  std::uint64_t seed = 1;
  std::vector<std::string> faults;      ///< NAME@SECONDS
  std::vector<std::string> conditions;  ///< NAME=VALUE
  double max_seconds = 3600.0;
  std::string clock_jump;  ///< BY@AT, s
  bool eyes = false;       ///< Sends scans; in unknown water it does anyway.
  std::string water;       ///< Sends pictures; of a mission by sight it does anyway.
  LinkArguments link;
};

struct SuperviseArguments {
  double silence_s = 1.0;
  bool json = false;
  LinkArguments link;
};

struct TopsideArguments {
  std::string command;  ///< abort, pause, resume, skip or status
  double patience_s = 5.0;
  bool json = false;
  LinkArguments link;
};

struct TestArguments {
  std::vector<std::string> scenarios;  ///< Files, or folders of them.
  bool json = false;
  bool inverted = false;  ///< Every expectation turned round must fail.
  bool mute = false;      ///< Scripts do nothing: what has one must fail.
  bool list_rules = false;
  int jobs = 0;           ///< 0: one for each core.
  std::string junit;      ///< Empty: none.
  std::string keep;       ///< Folder for logs; empty: none are kept.
  bool keep_all = false;  ///< Not only those of scenarios that failed.
};

struct ReplayArguments {
  std::string log;
  std::string mission;  ///< Empty: the log's own.
  bool json = false;
};

struct ExplainArguments {
  std::string log;
  bool json = false;
};

struct GraphArguments {
  std::string mission;
  std::string format = "dot";  ///< dot or scxml
  std::string output;          ///< Empty: stdout.
};

struct ImportArguments {
  std::string format;  ///< acfr or qgc
  std::string file;
  std::string output = ".";
  double speed = 0.4;
  double seabed_m = 0.0;
  std::optional<double> depth_m;
  bool json = false;
};

struct EstimateArguments {
  std::string folder;
  std::string estimator = "visual";  ///< visual or primitive
  std::string init = "rest";         ///< rest, motion or truth
  bool mono = false;
  bool no_depth = false;
  bool loops = false;
  double speed = 0.4;
  std::uint64_t seed = 1;
  std::string output;  ///< Empty: none.
  bool json = false;
};

[[nodiscard]] int run_check(const CheckArguments& arguments);
[[nodiscard]] int run_plan(const PlanArguments& arguments);
[[nodiscard]] int run_dive(const RunArguments& arguments);
[[nodiscard]] int run_sim(const SimArguments& arguments);
[[nodiscard]] int run_supervise(const SuperviseArguments& arguments);
[[nodiscard]] int run_topside(const TopsideArguments& arguments);
/// Makes a key and writes it to the file.
[[nodiscard]] int run_key(const std::string& path);
[[nodiscard]] int run_explain(const ExplainArguments& arguments);
[[nodiscard]] int run_graph(const GraphArguments& arguments);
[[nodiscard]] int run_import(const ImportArguments& arguments);
[[nodiscard]] int run_estimate(const EstimateArguments& arguments);
[[nodiscard]] int run_tests(const TestArguments& arguments);
[[nodiscard]] int run_replay(const ReplayArguments& arguments);

}  // namespace dive::mission
