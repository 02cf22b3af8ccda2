#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "common/suggest.h"
#include "mission/cli/commands.h"
#include "mission/cli/terminal.h"
#include "vehicle/link/bus.h"

namespace dive::mission {
namespace {

// A command's description is its examples, a blank line, and a sentence that summarises it: the
// command's own help prints all of it, the list of commands only the sentence.
class HelpFormatter final : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* command) const override {
    const std::string description = command->get_description();
    const std::size_t begin = description.rfind("\n\n") + 2;
    std::string sentence = description.substr(begin, description.find('.', begin) - begin);
    for (char& c : sentence) {
      if (c == '\n') c = ' ';
    }
    return fmt::format("  {:<9} {}\n", command->get_name(), sentence);
  }
};

constexpr const char* kConditionsHelp =
    "Set a condition of the simulated dive, e.g. current_x=0.01; a wrong name lists them all";

void add_check(CLI::App& app, CheckArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "check",
      "Examples:\n"
      "  dive check missions/window.xml            everything that can be proved on deck\n"
      "  dive check --static missions/window.xml   without the simulated dive\n"
      "  dive check --faults missions/window.xml   and dives with every fault in every state\n"
      "  dive check --faults --instants 40 --seed 7 missions/window.xml   at more instants\n"
      "  dive check --rules                        every rule and its code\n\n"
      "Checks a mission: document, map, a certified plan for every leg, the way out from every\n"
      "leg, time and energy, and a simulated dive. Exit status 0 when it is ready to dive.");
  command->add_option("MISSION", arguments.mission, "Mission file (XML)")->type_name("FILE");
  command->add_flag("--static", arguments.static_only, "Skip the simulated dive");
  command->add_flag("--faults", arguments.faults,
                    "Dive with every fault in every state, each dive to its end: every one must "
                    "end surfaced, or held in place, without a collision");
  command->add_flag("--pairs", arguments.pairs, "And with every two faults at once");
  command
      ->add_option("--instants", arguments.instants,
                   "Instants at which each fault begins, in each state (default: 3, of pairs 1): "
                   "soon after entry, shortly before exit, the others drawn with the seed")
      ->type_name("N")
      ->check(CLI::Range(1, 1000).description(""));
  command->add_option("--jobs", arguments.jobs, "Dives at a time (default: one for each core)")
      ->type_name("N")
      ->check(CLI::Range(1, 256).description(""));
  command->add_flag("--rules", arguments.list_rules, "List the rules and their codes");
  command->add_flag("--sarif", arguments.sarif, "The findings as SARIF 2.1.0 on stdout");
  command->add_option("--seed", arguments.seed, "Seed of plans and simulated dive")->type_name("N");
  command->add_option("--set", arguments.conditions, kConditionsHelp)
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

void add_plan(CLI::App& app, PlanArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "plan",
      "Examples:\n"
      "  dive plan missions/window.xml --svg plan.svg\n"
      "  dive plan --map missions/maps/window.sdf --start -1,-2,-4 --goal 9.8,-2,-4.6 "
      "--clearance 1 --attitude horizontal\n"
      "  dive plan --map missions/maps/wreck.sdf --start 5.8,0.3,-5.8,0,0,90 --goal 9,-3,-3 "
      "--allow-reduced\n"
      "  dive plan --cloud wreck.ply --start 0,-8,-14 --goal 2,9,-12 --clearance 0.8\n"
      "  dive plan --cloud scan_mm.pcd --unit mm --start 0,0,1.2 --goal 4,1,1.2 --json\n\n"
      "Plans every leg of a mission, or one path on a map or through a point cloud, and prints\n"
      "its certified clearance. Where a start lacks the clearance the path out of there is\n"
      "'reduced': it says where, how far and how much, and the exit status is 1 unless that is\n"
      "accepted, by --allow-reduced or by the mission's reduced_clearance.\n"
      "Poses are x,y,z[,roll,pitch,yaw_deg] in metres (east, north, up; the surface is z = 0).\n"
      "With a cloud they are in its own axes, UTM for instance, and so is the path; if it reaches\n"
      "above z = 0 there is taken to be no surface.");
  command->add_option("MISSION", arguments.mission, "Mission file (XML)")->type_name("FILE");
  command->add_option("--map", arguments.map, "Map file (SDF) instead of a mission")
      ->type_name("FILE");
  command->add_option("--cloud", arguments.cloud, "Point cloud (PCD, PLY) instead of a mission")
      ->type_name("FILE");
  command
      ->add_option("--unit", arguments.unit,
                   "Of the cloud: m, dm, cm, mm, km, ft or in (default: as it looks)")
      ->type_name("UNIT")
      ->check(CLI::IsMember({"m", "dm", "cm", "mm", "km", "ft", "in"}).description(""));
  command->add_option("--start", arguments.start, "Start pose, on map or cloud")->type_name("POSE");
  command->add_option("--goal", arguments.goal, "Goal pose, on map or cloud")->type_name("POSE");
  command->add_option("--clearance", arguments.clearance_m, "Clearance to keep, m")
      ->type_name("METRES")
      ->check(CLI::Range(0.0, 20.0).description(""));
  command
      ->add_option("--max-depth", arguments.max_depth_m,
                   "Depth limit, m (default: 50; with a cloud below all of it)")
      ->type_name("METRES")
      ->check(CLI::Range(0.0, 1000.0).description(""));
  command
      ->add_option("--attitude", arguments.attitude,
                   "free, flat (no roll) or horizontal (neither roll nor pitch)")
      ->type_name("MODE")
      ->check(CLI::IsMember({"free", "flat", "horizontal"}).description(""));
  command->add_flag("--allow-reduced", arguments.allow_reduced,
                    "Exit with 0 for a path out of a start that lacks the clearance");
  command->add_option("--seed", arguments.seed, "Seed of the warm starts")->type_name("N");
  command->add_option("--svg", arguments.svg, "Write a picture of map and path")->type_name("FILE");
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

/// Options of the commands that use LCM.
void add_url(CLI::App* command, LinkArguments& arguments) {
  command
      ->add_option("--lcm", arguments.url,
                   fmt::format("LCM URL of the vehicle (default: {})", link::kDefaultUrl))
      ->type_name("URL");
}

void add_pace(CLI::App* command, LinkArguments& arguments) {
  command->add_option("--speed", arguments.speed, "Times real time, for all processes alike")
      ->type_name("FACTOR")
      ->check(CLI::Range(0.1, 20.0).description(""));
}

void add_key(CLI::App* command, LinkArguments& arguments) {
  command->add_option("--key", arguments.key, "Key that topside and vehicle share")
      ->type_name("FILE");
}

void add_run(CLI::App& app, RunArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "run",
      "Examples:\n"
      "  dive run missions/window.xml\n"
      "  dive run missions/window.xml --seed 7 --log dive.lcmlog --svg dive.svg\n"
      "  dive run missions/wreck.xml --record wreck-data --water dark_wreck\n"
      "  dive run missions/window.xml --set heading_bias_sigma_deg=1 --leak-at 40\n"
      "  dive run missions/wreck_unknown.xml --diver 20:4,5,-12:1,5,-12\n"
      "  dive run missions/window.xml --lcm 'udpm://239.255.76.67:7667?ttl=0' --key topside.key\n\n"
      "Dives a mission in the built-in simulator, or a vehicle over LCM. Exit status 0 when it "
      "ended as planned, 1 when\n"
      "it failed or was aborted. In unknown water the map that was made is kept beside the log, as "
      "a map for the next dive.");
  command->add_option("MISSION", arguments.mission, "Mission file (XML)")
      ->type_name("FILE")
      ->required();
  command->add_option("--seed", arguments.seed, "Seed of everything random")->type_name("N");
  command->add_option("--log", arguments.log, "Log file (default: dive-runs/ID-seedN.lcmlog)")
      ->type_name("FILE");
  command
      ->add_option("--journal", arguments.journal,
                   "What a restart needs (default: the log's name and .journal)")
      ->type_name("FILE");
  command->add_flag("--resume", arguments.resume,
                    "Go on from the journal, as the mission's resume policy says");
  command->add_option("--svg", arguments.svg, "Write a picture of plan and dive")
      ->type_name("FILE");
  command
      ->add_option("--record", arguments.record,
                   "Record cameras, inertial unit and depth as an ASL (EuRoC) dataset")
      ->type_name("DIR");
  command
      ->add_option(
          "--water", arguments.water,
          "That the cameras see through (default: the mission's): clear_pool, coastal_sea, "
          "green_lake, dark_wreck")
      ->type_name("NAME");
  command->add_option("--set", arguments.conditions, kConditionsHelp)
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command->add_option("--leak-at", arguments.leak_at_s, "Let water in after so many seconds")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 1e6).description(""));
  command
      ->add_option("--fault", arguments.faults,
                   "Let something fail at a time, e.g. imu_silent@30 (repeatable)")
      ->type_name("NAME@SECONDS")
      ->allow_extra_args(false);
  command
      ->add_option("--diver", arguments.diver,
                   "Someone else in the water: from a time on from place to place")
      ->type_name("SECONDS:X,Y,Z:X,Y,Z...");
  command->add_option("--lcm", arguments.link.url, "Dive a vehicle at this LCM URL instead")
      ->type_name("URL");
  command
      ->add_option(
          "--cameras", arguments.cameras,
          "Calibration of that vehicle's cameras and IMU, in the ASL format; a mission with "
          "estimator=\"visual_inertial\" needs it")
      ->type_name("DIR");
  add_key(command, arguments.link);
  command->add_flag("--lockstep", arguments.link.lockstep, "With a vehicle of dive sim --lockstep");
  add_pace(command, arguments.link);
  command->add_flag("--stats", arguments.stats, "Say how the control loop kept time (with --lcm)");
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

void add_sim(CLI::App& app, SimArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "sim",
      "Examples:\n"
      "  dive sim missions/window.xml                    then, in another terminal:\n"
      "  dive run missions/window.xml --lcm 'udpm://239.255.76.67:7667?ttl=0'\n"
      "  dive sim missions/window.xml --lockstep         as fast as the machine goes\n"
      "  dive sim missions/maps/window.sdf --start -4,-2,-3\n"
      "  dive sim missions/maps/wreck.sdf --start 0,0,-8 --eyes\n"
      "  dive sim missions/pool_by_sight.xml --water coastal_sea\n"
      "  dive sim missions/pool_by_sight.xml --write-calibration cameras\n\n"
      "Is the vehicle, at the start of a mission or anywhere on a map: speaks LCM, obeys, and says "
      "in the end what\n"
      "really happened. In the unknown water of a mission it looks about in what that is rehearsed "
      "in, and sends what\n"
      "it sees; for a mission by sight it sends pictures and what the inertial unit says. Exit "
      "status 0 when it touched nothing.");
  command
      ->add_option("MISSION", arguments.mission, "Mission file (XML), or a map (SDF) with --start")
      ->type_name("FILE")
      ->required();
  command->add_option("--start", arguments.start, "Start pose on a map")->type_name("POSE");
  command->add_flag("--eyes", arguments.eyes,
                    "Send what a range camera sees (in unknown water it does anyway)");
  command
      ->add_option("--water", arguments.water,
                   "Send the pictures of the front cameras in such water (for a mission by sight: "
                   "instead of its own): clear_pool, coastal_sea, green_lake, dark_wreck")
      ->type_name("NAME");
  command
      ->add_option("--write-calibration", arguments.calibration,
                   "Only write the calibration of its cameras and IMU, for dive run --cameras")
      ->type_name("DIR");
  command->add_option("--seed", arguments.seed, "Seed of everything random")->type_name("N");
  command->add_option("--set", arguments.conditions, kConditionsHelp)
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command
      ->add_option("--fault", arguments.faults,
                   "Let something fail at a time, e.g. imu_silent@30 (repeatable)")
      ->type_name("NAME@SECONDS")
      ->allow_extra_args(false);
  command->add_option("--for", arguments.max_seconds, "End after so long (default: 3600)")
      ->type_name("SECONDS")
      ->check(CLI::Range(1.0, 1e6).description(""));
  command
      ->add_option("--clock-jump", arguments.clock_jump,
                   "Set the sensors' clock, so many seconds on, at a time, e.g. -3600@20")
      ->type_name("BY@SECONDS");
  add_url(command, arguments.link);
  command->add_flag("--lockstep", arguments.link.lockstep,
                    "Wait for the executive's command at every tick");
  add_pace(command, arguments.link);
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

void add_supervise(CLI::App& app, SuperviseArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "supervise",
      "Examples:\n"
      "  dive supervise --lcm 'udpm://239.255.76.67:7667?ttl=0'\n\n"
      "Surfaces the vehicle when the executive dies or hangs. Exit status 0 when it was not\n"
      "needed, 1 when it took over.");
  command
      ->add_option("--silence", arguments.silence_s,
                   "Take over after so long without a command (default: 1)")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.2, 2.0).description(""));
  add_url(command, arguments.link);
  add_pace(command, arguments.link);
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

struct TopsideHelp {
  const char* name;
  const char* sentence;
};
constexpr TopsideHelp kTopside[] = {
    {"abort", "Tells a vehicle that dives to come up: back along its trail where it must."},
    {"pause", "Tells a vehicle that dives to keep its place until resume."},
    {"resume", "Tells a vehicle that was paused to go on."},
    {"skip", "Tells a vehicle that dives to give up its present goal and go on to the next."},
    {"status", "Shows what a vehicle that dives is doing."}};

void add_topside(CLI::App& app, TopsideArguments& arguments) {
  for (const auto& [name, sentence] : kTopside) {
    const std::string word = name;
    const bool takes_key = word != "status";
    CLI::App* command = app.add_subcommand(
        word, fmt::format("Examples:\n  dive {}{}\n\n{}", word,
                          takes_key && word != "abort" ? " --key topside.key" : "", sentence));
    command->add_option("--patience", arguments.patience_s, "Give up after so long (default: 5)")
        ->type_name("SECONDS")
        ->check(CLI::Range(0.1, 600.0).description(""));
    add_url(command, arguments.link);
    if (takes_key) add_key(command, arguments.link);
    command->add_flag("--json", arguments.json, "One JSON object on stdout");
    command->callback([&arguments, word] { arguments.command = word; });
  }
}

void add_new_key(CLI::App& app, std::string& path) {
  CLI::App* command = app.add_subcommand("key",
                                         "Examples:\n"
                                         "  dive key topside.key\n\n"
                                         "Makes the key that lets topside pause, resume and skip.");
  command->add_option("FILE", path, "File to create")->type_name("FILE")->required();
}

void add_replay(CLI::App& app, ReplayArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "replay",
      "Examples:\n"
      "  dive replay dive-runs/window-seed1.lcmlog\n"
      "  dive replay dive-runs/window-seed1.lcmlog --mission window-changed.xml\n\n"
      "Feeds a log's inputs to a new executive and compares every output bit for bit. Exit status\n"
      "0 when they are identical, 1 when not: then it says where they first differ, or where the\n"
      "log is damaged.");
  command->add_option("LOG", arguments.log, "Log file (LCM event log)")
      ->type_name("FILE")
      ->required();
  command
      ->add_option("--mission", arguments.mission,
                   "Ask what this mission would have done with the same inputs")
      ->type_name("FILE");
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

void add_explain(CLI::App& app, ExplainArguments& arguments) {
  CLI::App* command = app.add_subcommand("explain",
                                         "Examples:\n"
                                         "  dive explain dive-runs/window-seed1.lcmlog\n\n"
                                         "Says why a dive went as it did: every transition with "
                                         "its cause and the guards that decided\n"
                                         "it, every failsafe with the rung chosen and what "
                                         "competed for it, every plan and why it was\n"
                                         "asked for; of a simulated dive also every collision.");
  command->add_option("LOG", arguments.log, "Log file (LCM event log)")
      ->type_name("FILE")
      ->required();
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

void add_graph(CLI::App& app, GraphArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "graph",
      "Examples:\n"
      "  dive graph missions/window.xml | dot -Tsvg > window.svg\n"
      "  dive graph missions/window.xml --format scxml --output window.scxml\n\n"
      "Writes the machine as it is built from a mission, the executive's own states included.");
  command->add_option("MISSION", arguments.mission, "Mission file (XML)")
      ->type_name("FILE")
      ->required();
  command->add_option("--format", arguments.format, "dot (Graphviz) or scxml (default: dot)")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"dot", "scxml"}).description(""));
  command->add_option("--output", arguments.output, "File to write (default: stdout)")
      ->type_name("FILE");
}

void add_import(CLI::App& app, ImportArguments& arguments) {
  CLI::App* command =
      app.add_subcommand("import",
                         "Examples:\n"
                         "  dive import acfr survey.xml --output missions/imported\n"
                         "  dive import qgc harbour.plan --depth 3\n\n"
                         "Turns someone else's mission into one of ours, on a flat seabed. Reports "
                         "its defects, and\n"
                         "whatever is changed, left out, added or not understood, at its line. "
                         "acfr: the XML of\n"
                         "ACFR's vehicles. qgc: QGroundControl's .plan or waypoint file.");
  command->add_option("FORMAT", arguments.format, "acfr or qgc")
      ->type_name("FORMAT")
      ->required()
      ->check(CLI::IsMember({"acfr", "qgc"}).description(""));
  command->add_option("FILE", arguments.file, "The file")->type_name("FILE")->required();
  command->add_option("--output", arguments.output, "Folder for mission and map (default: here)")
      ->type_name("DIR");
  command
      ->add_option("--speed", arguments.speed,
                   "Speed, m/s (default: of the slowest leg, or 0.4 where the aqua2 cannot swim "
                   "that); timeouts change by the same ratio")
      ->type_name("M/S")
      ->check(CLI::Range(0.1, 0.8).description(""));
  command
      ->add_option("--seabed", arguments.seabed_m,
                   "Depth of the seabed, m (default: 5 m below the deepest leg)")
      ->type_name("METRES")
      ->check(CLI::Range(0.5, 1000.0).description(""));
  command->add_option("--depth", arguments.depth_m, "qgc: swim everything at this depth, m")
      ->type_name("METRES")
      ->check(CLI::Range(0.0, 200.0).description(""));
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

void add_estimate(CLI::App& app, EstimateArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "estimate",
      "Examples:\n"
      "  dive estimate MH_01_easy                                 EuRoC's, at rest at first\n"
      "  dive estimate recording --init motion --output path.tum  ours, begun while swimming\n"
      "  dive estimate recording --mono --no-depth --json\n"
      "  dive estimate recording --loops                          closed loops as well\n\n"
      "Runs an estimator on a recording in the ASL (EuRoC) format: where the vehicle was, and how\n"
      "far that is from the truth, if the recording has it.");
  command->add_option("DIR", arguments.folder, "Folder with mav0, or with cam0 and imu0")
      ->type_name("DIR")
      ->required();
  command->add_flag("--mono", arguments.mono, "The left camera only");
  command->add_flag("--no-depth", arguments.no_depth, "Without the depth sensor");
  command->add_flag("--loops", arguments.loops,
                    "Close loops as well: places that are seen again (two cameras)");
  command->add_option("--estimator", arguments.estimator, "visual (default) or primitive")
      ->type_name("NAME")
      ->check(CLI::IsMember({"primitive", "visual"}).description(""));
  command
      ->add_option("--init", arguments.init,
                   "rest (default): it stands still at first; motion: it swims; truth: as recorded")
      ->type_name("HOW")
      ->check(CLI::IsMember({"rest", "motion", "truth"}).description(""));
  command
      ->add_option("--speed", arguments.speed,
                   "Forward, m/s: what primitive and --init motion expect (default: 0.4)")
      ->type_name("M/S")
      ->check(CLI::Range(-3.0, 3.0).description(""));
  command->add_option("--seed", arguments.seed, "Seed of the outlier rejection")->type_name("N");
  command->add_option("--output", arguments.output, "Write the trajectory (TUM format)")
      ->type_name("FILE");
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

void add_test(CLI::App& app, TestArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "test",
      "Examples:\n"
      "  dive test missions/scenarios                      every scenario of a folder\n"
      "  dive test missions/scenarios/way_back_blocked.xml --keep dive-runs\n"
      "  dive test missions/scenarios --junit results.xml  for continuous integration\n"
      "  dive test missions/scenarios --inverted           can each expectation fail?\n"
      "  dive test --rules                                 every rule for scenarios\n\n"
      "Dives scenarios: what happens to a dive is scripted, and what must come of it. Exit status "
      "0\n"
      "when all that is expected is so, 1 when not, 2 when a scenario is invalid.");
  command->add_option("SCENARIO", arguments.scenarios, "Scenario files (XML), or folders of them")
      ->type_name("PATH");
  command->add_flag("--inverted", arguments.inverted,
                    "Turn every expectation round, one by one: each must then fail");
  command->add_flag("--mute", arguments.mute,
                    "Disable scripts: a scenario that still passes does not test its script");
  command->add_option("--keep", arguments.keep, "Folder for the logs of scenarios that fail")
      ->type_name("DIR");
  command->add_flag("--keep-all", arguments.keep_all, "And of those that hold");
  command->add_option("--junit", arguments.junit, "Write the results as JUnit's XML")
      ->type_name("FILE");
  command->add_option("--jobs", arguments.jobs, "Dives at a time (default: one for each core)")
      ->type_name("N")
      ->check(CLI::Range(1, 256).description(""));
  command->add_flag("--rules", arguments.list_rules, "List the rules and their codes");
  command->add_flag("--json", arguments.json, "One JSON object on stdout");
}

// The probable meaning of a word that is neither a command nor an option.
std::optional<std::string> meant(const CLI::App& app, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    names.push_back(command->get_name());
    if (!command->parsed()) continue;
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  return closest_match(word, names);
}

int explain(const CLI::App& app, const CLI::ParseError& error, const char* first_word) {
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
    return app.exit(error) == 0 ? kExitSuccess : kExitUsage;  // --help, --version
  }
  std::string hint;
  for (const std::string& word : app.remaining(true)) {
    if (const auto name = meant(app, word)) hint = fmt::format(" (did you mean '{}'?)", *name);
  }
  if (hint.empty() && first_word != nullptr && app.get_subcommands().empty()) {
    if (const auto name = meant(app, first_word)) {
      hint = fmt::format(" (did you mean '{}'?)", *name);
    }
  }
  complain(error.what() + hint);
  note("Try 'dive --help' or 'dive COMMAND --help'.");
  return kExitUsage;
}

int dispatch(int argc, char** argv) {
  CLI::App app(
      "Examples:\n"
      "  dive check missions/window.xml     can this mission work?\n"
      "  dive run missions/window.xml       dive it in the simulator\n"
      "  dive replay LOG                    re-run a log, bit for bit\n"
      "  dive test missions/scenarios       dive scripted scenarios\n\n"
      "Mission executive for the Aqua2 autonomous underwater vehicle.",
      "dive");
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version", std::string("dive ") + DIVE_VERSION);
  app.require_subcommand(1);
  CheckArguments check;
  PlanArguments plan;
  RunArguments run;
  ReplayArguments replay;
  ExplainArguments explanation;
  GraphArguments graph;
  ImportArguments import;
  EstimateArguments estimate;
  SimArguments sim;
  SuperviseArguments supervise;
  TopsideArguments topside;
  std::string key;
  sim.link.url = supervise.link.url = topside.link.url = link::kDefaultUrl;
  TestArguments test;
  add_check(app, check);
  add_plan(app, plan);
  add_run(app, run);
  add_replay(app, replay);
  add_explain(app, explanation);
  add_graph(app, graph);
  add_import(app, import);
  add_estimate(app, estimate);
  add_sim(app, sim);
  add_supervise(app, supervise);
  add_topside(app, topside);
  add_new_key(app, key);
  add_test(app, test);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return explain(app, error, argc > 1 ? argv[1] : nullptr);
  }
  if (app.got_subcommand("check")) {
    if (check.mission.empty() && !check.list_rules) {
      complain("check needs a mission file");
      return kExitUsage;
    }
    return run_check(check);
  }
  if (app.got_subcommand("plan")) return run_plan(plan);
  if (app.got_subcommand("run")) return run_dive(run);
  if (app.got_subcommand("explain")) return run_explain(explanation);
  if (app.got_subcommand("graph")) return run_graph(graph);
  if (app.got_subcommand("import")) return run_import(import);
  if (app.got_subcommand("estimate")) return run_estimate(estimate);
  if (app.got_subcommand("sim")) return run_sim(sim);
  if (app.got_subcommand("supervise")) return run_supervise(supervise);
  if (app.got_subcommand("key")) return run_key(key);
  if (!topside.command.empty()) return run_topside(topside);
  if (app.got_subcommand("test")) {
    if (test.scenarios.empty() && !test.list_rules) {
      complain("test needs a scenario file, or a folder of them");
      return kExitUsage;
    }
    return run_tests(test);
  }
  return run_replay(replay);
}

}  // namespace
}  // namespace dive::mission

int main(int argc, char** argv) {
  try {
    return dive::mission::dispatch(argc, argv);
  } catch (const std::exception& error) {
    dive::mission::complain(std::string("internal error: ") + error.what());
    return dive::mission::kExitInternal;
  }
}
