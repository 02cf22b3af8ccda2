#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "common/operator_command.h"
#include "mission/cli/options.h"
#include "vehicle/link/bus.h"
#include "vehicle/simulator/water/named_waters.h"

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
  command
      ->add_option("--time-factor", arguments.time_factor,
                   "Factor on real time, the same for all processes")
      ->type_name("FACTOR")
      ->check(CLI::Range(0.1, 20.0).description(""));
}

void add_key(CLI::App* command, LinkArguments& arguments) {
  command
      ->add_option(
          "--key", arguments.key,
          "Key file that all processes of the dive share: authenticates every packet, and a "
          "bundle")
      ->type_name("FILE");
}

void add_insecure(CLI::App* command, LinkArguments& arguments) {
  command->add_flag("--insecure", arguments.insecure,
                    "Let packets leave the machine without a key: anyone can command the vehicle");
}

/// Options of run that apply to the built-in simulator alone.
void add_simulated_dive(CLI::App* command, RunArguments& arguments) {
  command->add_option("--svg", arguments.svg, "Write a drawing of plan and dive")
      ->type_name("FILE");
  command
      ->add_option("--record", arguments.record,
                   "Record cameras, IMU and depth as an ASL (EuRoC) dataset")
      ->type_name("DIR");
  command
      ->add_option("--simulated-water", arguments.simulated_water,
                   fmt::format("Simulated water type (default: the mission's): {}",
                               fmt::join(vehicle::water_names(), ", ")))
      ->type_name("NAME");
  command->add_option("--set", arguments.conditions, kConditionsHelp)
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command->add_option("--leak-at", arguments.leak_at_s, "Flood the hull at this time, s")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 1e6).description(""));
  command
      ->add_option("--fault", arguments.faults,
                   "Inject a fault at a time, e.g. imu_silent@30 (repeatable)")
      ->type_name("NAME@SECONDS")
      ->allow_extra_args(false);
  command->add_option("--diver", arguments.diver, "Add a diver: start time and positions in turn")
      ->type_name("SECONDS:X,Y,Z[:X,Y,Z...]");
}

/// Options of run that apply to a vehicle over LCM alone.
void add_vehicle(CLI::App* command, RunArguments& arguments) {
  command
      ->add_option("--lcm", arguments.link.url,
                   "Dive a vehicle at this LCM URL instead of the simulator")
      ->type_name("URL");
  command
      ->add_option(
          "--cameras", arguments.cameras,
          "Calibration of the vehicle's cameras and IMU in the ASL format; required by a mission "
          "with estimator=\"visual_inertial\"")
      ->type_name("DIR");
  add_key(command, arguments.link);
  add_insecure(command, arguments.link);
  command->add_flag("--lockstep", arguments.link.lockstep, "Lock-step with dive sim --lockstep");
  add_pace(command, arguments.link);
  command->add_flag("--stats", arguments.stats,
                    "Print the timing of the control loop (with --lcm)");
}

struct TopsideHelp {
  const char* name;
  const char* sentence;
};
constexpr TopsideHelp kTopside[] = {
    {to_string(OperatorCommand::kAbort),
     "Aborts the dive: the vehicle surfaces, under an overhead back along its trail first."},
    {to_string(OperatorCommand::kPause),
     "Pauses the dive: the vehicle stops and keeps depth and heading until resume."},
    {to_string(OperatorCommand::kResume), "Continues a paused dive."},
    {to_string(OperatorCommand::kSkip), "Skips the present goal and continues with the next."},
    {"status", "Shows the status of a dive."}};

}  // namespace

void add_run(CLI::App& app, RunArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "run",
      "Examples:\n"
      "  dive run missions/window.xml\n"
      "  dive run missions/window.xml --seed 7 --log dive.lcmlog --svg dive.svg\n"
      "  dive run missions/wreck.xml --record wreck-data --simulated-water dark_wreck\n"
      "  dive run missions/window.xml --set heading_bias_sigma_deg=1 --leak-at 40\n"
      "  dive run missions/wreck_unknown.xml --diver 20:4,5,-12:1,5,-12\n"
      "  dive run missions/window.xml --lcm 'udpm://239.255.76.67:7667?ttl=0' --key dive.key\n"
      "  dive run window.bundle --lcm 'udpm://239.255.76.67:7667?ttl=1' --key dive.key\n\n"
      "Dives a mission in the built-in simulator, or a vehicle over LCM. Exit status 0: it ended "
      "as\n"
      "planned; 1: it failed or was aborted; 4: the vehicle is silent or still diving. SIGTERM "
      "and\n"
      "SIGINT abort the dive; a second one ends the process. In an unknown environment the "
      "observed\n"
      "map is saved beside the log, as the known map of the next dive.");
  command
      ->add_option("MISSION", arguments.mission,
                   "Mission file (XML), or the bundle that dive check --bundle made of it")
      ->type_name("FILE")
      ->required();
  command->add_flag("--unchecked", arguments.unchecked,
                    "Dive a mission without a bundle, or a bundle whose vehicle and plans are not "
                    "verified again; the log records it");
  command->add_option("--seed", arguments.seed, "Seed of all random numbers")->type_name("N");
  command
      ->add_option("--log", arguments.log,
                   "Log file (default: dive-runs/ID-seedN.lcmlog; counts up)")
      ->type_name("FILE");
  command
      ->add_option("--journal", arguments.journal,
                   "Journal for a restart (default: the log's name with .journal)")
      ->type_name("FILE");
  command->add_flag("--resume", arguments.resume,
                    "Continue from the journal, as the mission's <resume> specifies");
  command->add_option("--vehicle", arguments.vehicle, kVehicleHelp)->type_name("FILE");
  add_simulated_dive(command, arguments);
  add_vehicle(command, arguments);
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--allow-outside", arguments.allow_outside, kOutsideHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

// Longer than a screen because it is a table: one entry per option.
void add_sim(CLI::App& app, SimArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "sim",
      "Examples:\n"
      "  dive sim missions/window.xml                    then, in another terminal:\n"
      "  dive run missions/window.xml --lcm 'udpm://239.255.76.67:7667?ttl=0'\n"
      "  dive sim missions/window.xml --lockstep         as fast as the machine goes\n"
      "  dive sim missions/maps/window.sdf --start -4,-2,-3\n"
      "  dive sim missions/maps/wreck.sdf --start 0,0,-8 --range-camera\n"
      "  dive sim missions/pool_visual_inertial.xml --simulated-water coastal_sea\n"
      "  dive sim missions/pool_visual_inertial.xml --write-calibration cameras\n\n"
      "Simulates the vehicle over LCM, from a mission's start or a given pose, and prints the\n"
      "ground-truth result. For a mission in an unknown environment it sends the scans of a range\n"
      "camera in the simulated world; for a visual-inertial mission it sends images and IMU "
      "samples.\n"
      "Exit status 0: no collision, and the dive ended within --for; 1: otherwise.");
  command
      ->add_option("MISSION", arguments.mission, "Mission file (XML), or a map (SDF) with --start")
      ->type_name("FILE")
      ->required();
  command->add_option("--start", arguments.start, "Start pose on a map")->type_name("POSE");
  command->add_flag("--range-camera", arguments.range_camera,
                    "Send the scans of a range camera (default if the mission needs them)");
  command
      ->add_option("--simulated-water", arguments.simulated_water,
                   fmt::format("Send images of the front cameras in this water type (default: the "
                               "mission's): {}",
                               fmt::join(vehicle::water_names(), ", ")))
      ->type_name("NAME");
  command
      ->add_option("--write-calibration", arguments.calibration,
                   "Write the calibration of its cameras and IMU for dive run --cameras, and exit")
      ->type_name("DIR");
  command->add_option("--seed", arguments.seed, "Seed of all random numbers")->type_name("N");
  command->add_option("--set", arguments.conditions, kConditionsHelp)
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command
      ->add_option("--fault", arguments.faults,
                   "Inject a fault at a time, e.g. imu_silent@30 (repeatable)")
      ->type_name("NAME@SECONDS")
      ->allow_extra_args(false);
  command->add_option("--for", arguments.max_seconds, "Maximum dive time (default: 3600)")
      ->type_name("SECONDS")
      ->check(CLI::Range(1.0, 1e6).description(""));
  command
      ->add_option("--clock-jump", arguments.clock_jump,
                   "Shift the sensors' clock by this many seconds at a time, e.g. -3600@20")
      ->type_name("BY@SECONDS");
  command
      ->add_option("--driver-restart", arguments.driver_restart,
                   "Restart the driver at a time: it is silent for so many seconds, forgets all\n"
                   "commands, and its clock starts at 0 again, e.g. 2@30")
      ->type_name("AWAY@SECONDS");
  add_url(command, arguments.link);
  add_key(command, arguments.link);
  command->add_flag("--lockstep", arguments.link.lockstep,
                    "Wait for the executive's command at every tick");
  add_pace(command, arguments.link);
  command->add_flag("--force", arguments.force, kForceHelp);
  command->add_flag("--allow-outside", arguments.allow_outside, kOutsideHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_supervise(CLI::App& app, SuperviseArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "supervise",
      "Examples:\n"
      "  dive supervise wreck.bundle --key dive.key --lcm 'udpm://239.255.76.67:7667?ttl=1'\n\n"
      "When the executive dies or hangs: holds the vehicle, gives it back to an executive that\n"
      "recovers or is restarted, and otherwise brings it home: along the exit path to open water,\n"
      "then up. With the mission that the executive dives, scans of the range camera tell it where "
      "in\n"
      "the known map it is; without, it dead-reckons. Exit status 0 when the executive finished, "
      "1\n"
      "when it had to bring the vehicle home.");
  command
      ->add_option("MISSION", arguments.mission,
                   "Mission file (XML), or the bundle that dive check --bundle made of it")
      ->type_name("FILE");
  command
      ->add_option("--vehicle", arguments.vehicle,
                   "Description of the vehicle (URDF), as for dive run (default: the bundle's, or "
                   "else the Aqua2's)")
      ->type_name("FILE");
  command
      ->add_option("--command-timeout", arguments.command_timeout_s,
                   "Hold the vehicle after so long without a command (default: 1)")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.2, 2.0).description(""));
  add_url(command, arguments.link);
  add_key(command, arguments.link);
  add_insecure(command, arguments.link);
  add_pace(command, arguments.link);
  command->add_flag("--allow-outside", arguments.allow_outside, kOutsideHelp);
  command->add_flag("--json", arguments.json, kJsonHelp);
}

void add_topside(CLI::App& app, TopsideArguments& arguments) {
  for (const auto& [name, sentence] : kTopside) {
    const std::string word = name;
    const bool needs_key = word != "status" && word != "abort";
    CLI::App* command =
        app.add_subcommand(word, fmt::format("Examples:\n  dive {}{}\n\n{}", word,
                                             needs_key ? " --key dive.key" : "", sentence));
    command->add_option("--timeout", arguments.timeout_s, "Maximum time to wait (default: 5)")
        ->type_name("SECONDS")
        ->check(CLI::Range(0.1, 600.0).description(""));
    add_url(command, arguments.link);
    add_key(command, arguments.link);
    command->add_flag("--json", arguments.json, kJsonHelp);
    command->callback([&arguments, word] { arguments.command = find_operator_command(word); });
  }
}

void add_new_key(CLI::App& app, KeyArguments& arguments) {
  CLI::App* command =
      app.add_subcommand("key",
                         "Examples:\n"
                         "  dive key dive.key\n\n"
                         "Creates the key with which the processes of a dive authenticate their\n"
                         "packets, and topside its requests.");
  command->add_option("FILE", arguments.path, "File to create")->type_name("FILE")->required();
  command->add_flag("--force", arguments.force, "Replace a key that exists");
  command->add_flag("--json", arguments.json, kJsonHelp);
}

}  // namespace dive::mission
