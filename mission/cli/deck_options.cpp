#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "estimation/dataset/bag/bag_preset.h"
#include "mission/check/dive_series.h"
#include "mission/cli/options.h"
#include "vehicle/speed_range.h"

namespace dive::mission {
namespace {

/// The files that check writes for a mission that is ready.
void add_check_results(CLI::App* command, CheckArguments& arguments) {
  command
      ->add_option("--card", arguments.card,
                   "Write the dive card of a mission that is ready: one A4 page to print (HTML)")
      ->type_name("FILE");
  command
      ->add_option("--bundle", arguments.bundle,
                   "Write the verified bundle of a mission that is ready: one file with mission, "
                   "maps, vehicle, plans and the result of the check, for dive run")
      ->type_name("FILE");
  command
      ->add_option("--key", arguments.key,
                   "Add a code to the bundle, made with this key (dive key makes a key)")
      ->type_name("FILE");
}

/// What a bag does not say itself.
void add_bag_options(CLI::App* command, EstimateArguments& arguments) {
  command
      ->add_option(
          "--calibration", arguments.calibration,
          "Calibration of the sensors: of a bag, or instead of a folder's own; may be given again")
      ->type_name("FILE")
      ->allow_extra_args(false);
  std::vector<std::string> presets;
  for (const auto& preset : estimation::bag_presets()) presets.push_back(preset.name);
  command
      ->add_option("--preset", arguments.preset,
                   fmt::format("Topics of a published data set: {}", fmt::join(presets, ", ")))
      ->type_name("NAME")
      ->check(CLI::IsMember(presets));
  command
      ->add_option(
          "--topic", arguments.topics,
          "Topic of a bag's sensor, imu=/name; also cam0, cam1, depth, velocity, truth; may be "
          "given again")
      ->type_name("SENSOR=NAME")
      ->allow_extra_args(false);
}

}  // namespace

void add_check(CLI::App& app, CheckArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "check",
      "Examples:\n"
      "  dive check missions/window.xml            everything that can be proved on deck\n"
      "  dive check --static missions/window.xml   without simulated dives\n"
      "  dive check --dives 100 missions/window.xml   with exactly 100 of them\n"
      "  dive check --faults missions/window.xml   also dives with every fault in every state\n"
      "  dive check --faults --instants 40 --seed 7 missions/window.xml   at more instants\n"
      "  dive check missions/window.xml --card window.html   and a card to print for the dive\n"
      "  dive check missions/window.xml --bundle window.bundle --key dive.key   for dive run\n"
      "  dive check --rules                        every rule and its code\n\n"
      "Checks a mission: document, map, a certified plan for every leg, the exit path from every\n"
      "leg, time and energy, and simulated dives, each with different errors of vehicle, sensors\n"
      "and map, drawn from its seed. Exit status 0: ready to dive; 1: a simulated dive\n"
      "collides or does not end safely, or too many end otherwise than planned; 2: it cannot\n"
      "work, or cannot be read.");
  command->add_option("MISSION", arguments.mission, "Mission file (XML)")->type_name("FILE");
  command->add_flag("--static", arguments.static_only, "Skip the simulated dives");
  command
      ->add_option("--dives", arguments.dives,
                   "Number of simulated dives, with consecutive seeds (default: as many as start "
                   "within 10 s, at least 10; the number is printed, and the same number gives the "
                   "same result)")
      ->type_name("N")
      ->check(CLI::Range(1, kMaxDives).description(""));
  command->add_flag("--faults", arguments.faults,
                    "Dive with every fault in every state: each dive must end at the surface, or "
                    "held in place, without a collision; no current is drawn in these dives unless "
                    "--set current_sigma=N asks for it");
  command->add_flag("--pairs", arguments.pairs, "Also dive with every pair of faults at once");
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
  add_check_results(command, arguments);
  command
      ->add_option("--seed", arguments.seed,
                   "Seed of the plans and of the first simulated dive (default: 1)")
      ->type_name("N");
  command->add_option("--set", arguments.conditions, kConditionsHelp)
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command->add_option("--vehicle", arguments.vehicle, kVehicleHelp)->type_name("FILE");
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--allow-outside", arguments.allow_outside, kOutsideHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
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
      "its certified clearance. A path from a start that lacks the clearance is 'reduced':\nthe "
      "result says where, how far and how much. The exit status is then 1, unless\n--allow-reduced "
      "or the mission's reduced_clearance accepts it.\n"
      "Poses are x,y,z[,roll,pitch,yaw_deg] in metres (east, north, up; the surface is z = 0).\n"
      "With a cloud, poses and path are in its own axes (UTM, for instance); a cloud that extends\n"
      "above z = 0 has no water surface.");
  command->add_option("MISSION", arguments.mission, "Mission file (XML)")->type_name("FILE");
  command
      ->add_option("--map", arguments.map,
                   "Map file (SDF, or a grid .tif, .asc) instead of a mission")
      ->type_name("FILE");
  command->add_option("--cloud", arguments.cloud, "Point cloud (PCD, PLY) instead of a mission")
      ->type_name("FILE");
  command
      ->add_option(
          "--unit", arguments.unit,
          "Unit of the cloud: m, dm, cm, mm, km, ft or in (default: guessed from its size)")
      ->type_name("UNIT")
      ->check(CLI::IsMember({"m", "dm", "cm", "mm", "km", "ft", "in"}));
  command->add_option("--start", arguments.start, "Start pose in the map or cloud")
      ->type_name("POSE");
  command->add_option("--goal", arguments.goal, "Goal pose in the map or cloud")->type_name("POSE");
  command->add_option("--clearance", arguments.clearance_m, "Clearance to keep, m")
      ->type_name("METRES")
      ->check(CLI::Range(0.0, 20.0).description(""));
  command
      ->add_option("--max-depth", arguments.max_depth_m,
                   "Depth limit, m (default: 50; with a cloud: below all its points)")
      ->type_name("METRES")
      ->check(CLI::Range(0.0, 1000.0).description(""));
  command
      ->add_option("--attitude", arguments.attitude,
                   "free, flat (no roll) or horizontal (neither roll nor pitch)")
      ->type_name("MODE")
      ->check(CLI::IsMember({"free", "flat", "horizontal"}));
  command->add_flag("--allow-reduced", arguments.allow_reduced,
                    "Accept a path with reduced clearance from a start that lacks it");
  command->add_option("--seed", arguments.seed, "Seed of the path search")->type_name("N");
  command->add_option("--svg", arguments.svg, "Write a drawing of map and path")->type_name("FILE");
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--allow-outside", arguments.allow_outside, kOutsideHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_test(CLI::App& app, TestArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "test",
      "Examples:\n"
      "  dive test missions/scenarios                      every scenario of a folder\n"
      "  dive test missions/scenarios/return_path_blocked.xml --keep dive-runs\n"
      "  dive test missions/scenarios --junit results.xml  for continuous integration\n"
      "  dive test missions/scenarios --negate           can each expectation fail?\n"
      "  dive test --rules                                 every rule for scenarios\n\n"
      "Runs scenarios: scripted dives with expected results. Exit status 0: all pass; 1: some "
      "fail;\n"
      "2: a scenario is invalid.");
  command->add_option("SCENARIO", arguments.scenarios, "Scenario files (XML), or folders of them")
      ->type_name("PATH");
  command->add_flag("--negate", arguments.negate,
                    "Negate every expectation, one by one: each must then fail");
  command->add_flag("--disable-scripts", arguments.disable_scripts,
                    "Disable scripts: a scenario that still passes does not test its script");
  command->add_option("--keep", arguments.keep, "Folder for the logs of scenarios that fail")
      ->type_name("DIR");
  command->add_flag("--keep-all", arguments.keep_all, "Also keep the logs of scenarios that pass");
  command->add_option("--junit", arguments.junit, "Write the results as JUnit's XML")
      ->type_name("FILE");
  command->add_option("--jobs", arguments.jobs, "Dives at a time (default: one for each core)")
      ->type_name("N")
      ->check(CLI::Range(1, 256).description(""));
  command->add_flag("--rules", arguments.list_rules, "List the rules and their codes");
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--allow-outside", arguments.allow_outside, kOutsideHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_graph(CLI::App& app, GraphArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "graph",
      "Examples:\n"
      "  dive graph missions/window.xml | dot -Tsvg > window.svg\n"
      "  dive graph missions/window.xml --format scxml --output window.scxml\n\n"
      "Writes the state machine built from a mission, including the executive's own states.");
  command->add_option("MISSION", arguments.mission, "Mission file (XML), or a verified bundle")
      ->type_name("FILE")
      ->required();
  command->add_option("--format", arguments.format, "dot (Graphviz) or scxml (default: dot)")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"dot", "scxml"}));
  command->add_option("--output", arguments.output, "File to write (default: stdout)")
      ->type_name("FILE");
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_import(CLI::App& app, ImportArguments& arguments) {
  CLI::App* command =
      app.add_subcommand("import",
                         "Examples:\n"
                         "  dive import acfr survey.xml --output missions/imported\n"
                         "  dive import qgc harbour.plan --depth 3\n\n"
                         "Converts a foreign mission to ours, over a flat seabed. Reports its "
                         "defects, and everything\n"
                         "that is changed, left out, added or not understood, with its line. "
                         "acfr: the XML of\n"
                         "ACFR's vehicles. qgc: QGroundControl's .plan or waypoint file.");
  command->add_option("FORMAT", arguments.format, "acfr or qgc")
      ->type_name("FORMAT")
      ->required()
      ->check(CLI::IsMember({"acfr", "qgc"}));
  command->add_option("FILE", arguments.file, "The file")->type_name("FILE")->required();
  command->add_option("--output", arguments.output, "Folder for mission and map (default: here)")
      ->type_name("DIR");
  command
      ->add_option("--speed", arguments.speed,
                   "Speed, m/s (default: the slowest leg's, or 0.4 if the aqua2 cannot swim that); "
                   "timeouts are scaled by the same ratio")
      ->type_name("M/S")
      ->check(CLI::Range(vehicle::kMinSpeed, vehicle::kMaxSpeed).description(""));
  command
      ->add_option("--seabed", arguments.seabed_m,
                   "Depth of the seabed, m (default: 5 m below the deepest leg)")
      ->type_name("METRES")
      ->check(CLI::Range(0.5, 1000.0).description(""));
  command->add_option("--depth", arguments.depth_m, "qgc: depth of all waypoints, m")
      ->type_name("METRES")
      ->check(CLI::Range(0.0, 200.0).description(""));
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_replay(CLI::App& app, ReplayArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "replay",
      "Examples:\n"
      "  dive replay dive-runs/window-seed1.lcmlog\n"
      "  dive replay dive-runs/window-seed1.lcmlog --mission window-changed.xml\n\n"
      "Feeds the inputs of a log to a new executive and compares every output bit for bit. Exit\n"
      "status 0: identical; 1: different, with the first difference, or damaged, with each gap;\n"
      "2: unreadable, or different because log and program differ in their mathematics.");
  command->add_option("LOG", arguments.log, "Log file (LCM event log)")
      ->type_name("FILE")
      ->required();
  command
      ->add_option("--mission", arguments.mission,
                   "Replay with this mission (or bundle) instead: what would it have done?")
      ->type_name("FILE");
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_diff(CLI::App& app, DiffArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "diff",
      "Examples:\n"
      "  dive diff missions/window.xml window-changed.xml   legs, budgets and results\n"
      "  dive diff window.xml window.bundle                 is this what was checked?\n"
      "  dive diff dive-runs/window-seed1.lcmlog dive-runs/window-seed2.lcmlog\n"
      "  dive diff before.json after.json                   of dive plan --json\n\n"
      "Compares two missions or bundles, two plans, or two logs by what they mean: layout and\n"
      "comments of a file count for nothing. Of two logs it names the first decision that "
      "differs,\n"
      "and the inputs that differ before it. Missions are planned, not dived. Exit status 0: "
      "equal;\n"
      "1: different; 2: unreadable, or not of one kind.");
  command->add_option("A", arguments.a, "Mission, bundle, plan or log")
      ->type_name("FILE")
      ->required();
  command->add_option("B", arguments.b, "Another of the same kind")->type_name("FILE")->required();
  command->add_option("--seed", arguments.seed, "Seed of the plans of missions (default: 1)")
      ->type_name("N");
  command->add_flag("--allow-outside", arguments.allow_outside, kOutsideHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_explain(CLI::App& app, ExplainArguments& arguments) {
  CLI::App* command = app.add_subcommand("explain",
                                         "Examples:\n"
                                         "  dive explain dive-runs/window-seed1.lcmlog\n\n"
                                         "Explains a dive: every transition with its cause and "
                                         "guards, every failsafe with the\n"
                                         "response and the causes that competed, every plan with "
                                         "the reason of its request,\n"
                                         "and the collisions of a simulated dive.");
  command->add_option("LOG", arguments.log, "Log file (LCM event log)")
      ->type_name("FILE")
      ->required();
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_report(CLI::App& app, ReportArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "report",
      "Examples:\n"
      "  dive report dive-runs/window-seed1.lcmlog --output window.html   a dive\n"
      "  dive report missions/window.xml --output plan.html               the planned legs\n\n"
      "Writes one HTML file that shows a dive, or the plan of a mission, in any browser without a\n"
      "network: result, 3-D scene, position error beside the required clearance, depth, speed,\n"
      "battery, estimator, states with their causes, and plans, all at the same chosen time.\n"
      "Ground truth is shown where the log has it; a log that ends early is shown up to its end.");
  command
      ->add_option("FILE", arguments.file,
                   "Log file (LCM event log), or mission file (XML) whose legs are planned")
      ->type_name("FILE")
      ->required();
  command->add_option("--output", arguments.output, "HTML file to write")
      ->type_name("FILE")
      ->required();
  command->add_option("--seed", arguments.seed, "Mission: seed of the path search")->type_name("N");
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--allow-outside", arguments.allow_outside, kOutsideHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_fit(CLI::App& app, FitArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "fit",
      "Examples:\n"
      "  dive fit dive-runs/*.lcmlog --output my_aqua2.urdf      each dive checks the others' fit\n"
      "  dive fit monday*.lcmlog --validate tuesday*.lcmlog --output my_aqua2.urdf\n"
      "  dive run missions/wreck.xml --vehicle my_aqua2.urdf     dives with the fitted model\n\n"
      "Fits the vehicle's motion model to logs of dives with fixes; others are left out.\n"
      "Prints each coefficient with its standard deviation, and the open-loop error before and "
      "after\n"
      "on dives that were not fitted. Ground truth is not used. Exit status 0: better than before; "
      "1: no\n"
      "better, and nothing is written; 2: a log cannot be read, or there are too few dives.");
  command->add_option("LOG", arguments.logs, "Log files (LCM event logs) of one vehicle")
      ->type_name("FILE")
      ->required();
  command
      ->add_option("--validate", arguments.validate,
                   "Logs that measure the fit and are not fitted (default: each dive is predicted "
                   "by a fit to the others)")
      ->type_name("FILE");
  command->add_option("--output", arguments.output, "Write the vehicle's description (URDF)")
      ->type_name("FILE");
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_estimate(CLI::App& app, EstimateArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "estimate",
      "Examples:\n"
      "  dive estimate MH_01_easy                                 EuRoC\n"
      "  dive estimate recording --speed 0.3 --output path.tum    swimming at about 0.3 m/s at "
      "first\n"
      "  dive estimate recording --mono --no-depth --json\n"
      "  dive estimate recording --loops                          with loop closure\n"
      "  dive estimate recording --against openvins.tum           beside another estimator\n"
      "  dive estimate dive.mcap --calibration camchain.yaml --calibration imu.yaml\n"
      "  dive estimate V1_01.bag --preset euroc --calibration V1_01_easy\n\n"
      "Runs an estimator on a recording: the trajectory, and its error if the recording has "
      "ground\n"
      "truth. A recording is a folder in the ASL (EuRoC) format, a ROS 1 bag, or a bag of ROS 2\n"
      "(MCAP or sqlite3); a bag needs a calibration: by Kalibr, a sensor.yaml, or a folder of "
      "them.\n"
      "The visual-inertial estimator is that of a dive, with its checks of images and filter. "
      "After "
      "a\n"
      "failure, a gap of the IMU of 1 s or darkness of 15 s it begins again from images; the "
      "report "
      "says\n"
      "when and why. Exit status 0: estimated; 1: the filter failed, and no estimate was trusted "
      "after\n"
      "it; 2: nothing can be estimated.");
  command->add_option("RECORDING", arguments.folder, "Folder with mav0, or with cam0 and imu0; bag")
      ->type_name("PATH")
      ->required();
  add_bag_options(command, arguments);
  command->add_flag("--mono", arguments.mono, "Use the left camera only");
  command->add_flag("--no-depth", arguments.no_depth, "Do not use the depth sensor");
  command->add_flag("--loops", arguments.loops,
                    "Close loops where a place is recognised (two cameras)");
  command->add_option("--estimator", arguments.estimator, "visual_inertial (default) or primitive")
      ->type_name("NAME")
      ->check(CLI::IsMember({"primitive", "visual_inertial"}));
  command
      ->add_option("--init", arguments.init,
                   "Initialise from images (default; at rest or in motion) or from ground truth")
      ->type_name("HOW")
      ->check(CLI::IsMember({"images", "truth"}));
  command
      ->add_option("--speed", arguments.speed,
                   "Expected forward speed, m/s, where none is recorded (primitive: 0.4; helps "
                   "--init images, and used in the dark)")
      ->type_name("M/S")
      ->check(CLI::Range(-3.0, 3.0).description(""));
  command->add_option("--seed", arguments.seed, "Seed of the outlier rejection")->type_name("N");
  command
      ->add_option("--against", arguments.against,
                   "Compare with another estimator's trajectory of the recording (TUM format)")
      ->type_name("FILE");
  command->add_option("--output", arguments.output, "Write the trajectory (TUM format)")
      ->type_name("FILE");
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

}  // namespace dive::mission
