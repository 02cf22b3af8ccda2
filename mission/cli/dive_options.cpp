#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "mission/cli/options.h"
#include "vehicle/link/bus.h"

namespace dive::mission {
namespace {

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

/// Options of run that apply to the built-in simulator alone.
void add_simulated_dive(CLI::App* command, RunArguments& arguments) {
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
}

/// Options of run that apply to a vehicle over LCM alone.
void add_vehicle(CLI::App* command, RunArguments& arguments) {
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

}  // namespace

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
  add_simulated_dive(command, arguments);
  add_vehicle(command, arguments);
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

}  // namespace dive::mission
