// The commands that use LCM beside `dive run`: the simulated vehicle, the supervisor, topside.

#include <atomic>
#include <cmath>
#include <csignal>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/xml.h"
#include "mission/cli/bundle_file.h"
#include "mission/cli/commands.h"
#include "mission/cli/file_kind.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/open_link.h"
#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/executive/behavior_factory.h"
#include "mission/executive/position_priors.h"
#include "mission/link/supervisor.h"
#include "mission/link/topside.h"
#include "mission/record/dataset_recorder.h"
#include "mission/simulation/simulated_cameras.h"
#include "mission/simulation/simulated_conditions.h"
#include "mission/simulation/simulated_dive.h"
#include "mission/simulation/simulated_vehicle.h"
#include "planning/world/sdf.h"
#include "planning/world/world_digest.h"
#include "vehicle/link/authority.h"
#include "vehicle/link/bus.h"

namespace dive::mission {
namespace {

std::atomic<bool> interrupted = false;

void interrupt(int /*signal*/) { interrupted = true; }

/// Two numbers of s, `first`@`at`; prints an error and returns nothing if they are none.
/// `expected` names and shows their form.
struct TimedValue {
  double first = 0.0;
  double at_s = 0.0;
};
std::optional<TimedValue> parse_timed(const char* option, const std::string& written,
                                      const char* expected) {
  const std::size_t at = written.find('@');
  const std::optional<double> first = parse_number(written.substr(0, at));
  const std::optional<double> at_s =
      at == std::string::npos ? std::nullopt : parse_number(written.substr(at + 1));
  constexpr double kMax = 1e9;
  if (first && at_s && std::abs(*first) <= kMax && *at_s >= 0.0 && *at_s <= kMax) {
    return TimedValue{*first, *at_s};
  }
  complain(fmt::format("{} {}: expected {}", option, written, expected));
  return std::nullopt;
}

/// False if a disturbance of the link cannot be read, which is printed.
bool parse_disturbances(const SimArguments& arguments, VehicleSettings& settings) {
  if (!arguments.clock_jump.empty()) {
    const auto jump =
        parse_timed("--clock-jump", arguments.clock_jump, "BY@SECONDS, e.g. -3600@20");
    if (!jump) return false;
    settings.clock_jump = ClockJump{jump->at_s, jump->first};
  }
  if (arguments.driver_restart.empty()) return true;
  const auto restart =
      parse_timed("--driver-restart", arguments.driver_restart, "AWAY@SECONDS, e.g. 2@30");
  if (!restart) return false;
  if (restart->first < 0.0 || settings.lockstep) {
    complain(settings.lockstep ? "--driver-restart: in lock-step the vehicle waits for commands: "
                                 "leave --lockstep out"
                               : "--driver-restart: the driver is away for 0 s or longer");
    return false;
  }
  settings.driver_restart = DriverRestart{restart->at_s, restart->first};
  return true;
}

/// The vehicle's start pose and its world.
struct Place {
  planning::World world;
  Pose start_X_WB;
  vehicle::Conditions conditions = {};
  /// Used by the mission.
  std::optional<vehicle::RangeCameraOptions> range_camera = {};
  std::string water = {};      ///< Water type of the cameras; empty without cameras.
  std::vector<Tag> tags = {};  ///< Tags visible to the cameras.
};

/// The start of a mission. Prints the errors of the mission and returns nothing if there are any.
std::optional<Place> place_of_mission(const std::string& path, planning::Resources resources) {
  Diagnostics diagnostics;
  std::optional<LoadedMission> loaded = load(path, resources, diagnostics);
  if (!loaded) {
    print_diagnostics(diagnostics);
    return std::nullopt;
  }
  if (!has_simulation_map(loaded->mission)) {
    complain(
        fmt::format("{}: the environment is unknown and no simulated world is given: write "
                    "simulation_map=\"maps/NAME.sdf\" at <map>, or give a map with --start POSE "
                    "--range-camera",
                    path));
    return std::nullopt;
  }
  const Pose start = start_pose(loaded->mission, loaded->world);
  std::vector<Tag> tags = known_tags(loaded->mission, loaded->world);
  return Place{std::move(loaded->simulated_world).value_or(std::move(loaded->world)),
               start,
               simulated_conditions(loaded->mission),
               range_camera_of(loaded->mission),
               uses_visual_inertial(loaded->mission) ? loaded->mission.simulated_water : "",
               std::move(tags)};
}

/// A pose on a map. Prints the errors of the map and returns nothing if there are any.
std::optional<Place> place_on_map(const std::string& path, const std::string& written,
                                  planning::Resources resources) {
  const std::optional<WrittenPose> start = parse_pose("--start", written);
  if (!start) return std::nullopt;
  Diagnostics diagnostics;
  std::optional<planning::World> world;
  if (is_text_of(FileKind::kMap, path, diagnostics)) {
    world = planning::load_sdf(path, diagnostics, resources);
  }
  if (world) return Place{std::move(*world), start->pose};
  print_diagnostics(diagnostics);
  return std::nullopt;
}

/// Prints an error and returns nothing on failure.
std::optional<Place> find_place(const SimArguments& arguments) {
  const std::string& path = arguments.mission;
  const FileKind kind = kind_of_file(path);
  const bool has_start = !arguments.start.empty();
  if (kind == FileKind::kMap && !has_start) {
    complain(fmt::format("{}: this is a map: give the start pose with --start x,y,z", path));
    return std::nullopt;
  }
  if (kind == FileKind::kMission && has_start) {
    complain(
        fmt::format("{}: this is a mission, and the vehicle starts where it says: leave "
                    "--start out, or give a map instead",
                    path));
    return std::nullopt;
  }
  const planning::Resources where = resources(arguments.allow_outside);
  return has_start ? place_on_map(path, arguments.start, where) : place_of_mission(path, where);
}

void print_report(const VehicleReport& report) {
  print(fmt::format("{}: {} collision(s), ended {:.2f} m deep ({})",
                    report.collisions.empty() ? "UNHARMED" : "COLLIDED", report.collisions.size(),
                    report.final_depth_m, report.ended));
  print_contacts(report.nearest, report.collisions);
  print(
      fmt::format("  {:.0f} s, {:.1f} m swum, {:.1f} Wh; {:.1f} s without a command, {:.1f} s "
                  "under the supervisor, {} command(s) refused",
                  report.duration_s, report.distance_m, report.energy_wh, report.silent_s,
                  report.supervised_s, report.refused));
}

void print_json_report(const VehicleReport& report) {
  print_json({{"ended", report.ended},
              {"duration_s", report.duration_s},
              {"distance_m", report.distance_m},
              {"min_clearance_m", report.nearest.clearance_m},
              {"nearest", to_json(report.nearest)},
              {"collisions", report.collisions.size()},
              {"collision_list", to_json(report.collisions)},
              {"final_depth_m", report.final_depth_m},
              {"energy_wh", report.energy_wh},
              {"silent_s", report.silent_s},
              {"supervised_s", report.supervised_s},
              {"refused", report.refused}});
}

int print_status(link::Bus& bus, Clock& clock, const TopsideArguments& arguments) {
  const tl::expected<VehicleStatus, std::string> received =
      listen(bus, arguments.link.url, clock, arguments.timeout_s);
  if (!received) {
    complain(received.error());
    return kExitFailed;
  }
  const auto& [heartbeat, status, estimate, health] = *received;
  const char* const estimator = estimation::to_string(estimate.source);
  const double sigma_m = estimation::horizontal_sigma(estimate);
  if (arguments.json) {
    nlohmann::ordered_json json = {{"state", status.state},
                                   {"goal", status.goal},
                                   {"rung", status.rung},
                                   {"distance_to_go_m", status.distance_to_go_m},
                                   {"time_to_go_s", status.time_to_go_s},
                                   {"depth_m", status.depth_m},
                                   {"clearance_m", status.clearance_m},
                                   {"cross_track_m", status.cross_track_m},
                                   {"margin_sigma", nullptr},
                                   {"estimator", estimator},
                                   {"position_sigma_m", sigma_m},
                                   {"finished", heartbeat.finished},
                                   {"has_key", heartbeat.has_key},
                                   {"battery_fraction", nullptr}};
    if (std::isfinite(status.margin_sigma)) json["margin_sigma"] = status.margin_sigma;
    if (health) {
      json["battery_fraction"] = health->battery_fraction;
      json["voltage_v"] = health->voltage_v;
      json["current_a"] = health->current_a;
      json["temperature_c"] = health->temperature_c;
      json["leak"] = health->leak;
    }
    print_json(json);
    return kExitSuccess;
  }
  print(fmt::format("{}{}{}", status.state, status.goal.empty() ? "" : " -> " + status.goal,
                    heartbeat.finished ? " (finished)" : ""));
  print(fmt::format("  {:.1f} m deep, to go {:.1f} m and {:.0f} s, failsafe rung {}",
                    status.depth_m, status.distance_to_go_m, status.time_to_go_s, status.rung));
  print(fmt::format("  position: {} estimator, one sigma {:.2f} m", estimator, sigma_m));
  if (std::isfinite(status.margin_sigma)) {
    print(fmt::format("  margin to the obstacles ahead: {:.1f} sigma", status.margin_sigma));
  }
  if (health) {
    print(fmt::format("  battery {:.0f} %, {:.1f} V, {:.1f} A, {:.0f} degrees, {}",
                      100.0 * health->battery_fraction, health->voltage_v, health->current_a,
                      health->temperature_c, health->leak ? "WATER IN THE HULL" : "dry"));
  }
  const link::Refusals& refused = heartbeat.refused;
  const int all = refused.auth_failed + refused.replayed + refused.stale;
  if (all > 0) print(fmt::format("  {} operator request(s) refused", all));
  return kExitSuccess;
}

int write_calibration(const SimArguments& arguments, const VehicleSettings& settings) {
  if (!settings.cameras) {
    complain(
        fmt::format("{}: this vehicle has no cameras to calibrate: give --simulated-water NAME",
                    arguments.mission));
    return kExitUsage;
  }
  const tl::expected<void, OutputError> written =
      write_asl_calibration(arguments.calibration,
                            asl_sensors(*settings.cameras, with_imu(settings.conditions),
                                        "simulated cameras of dive " DIVE_VERSION),
                            existing(arguments.force));
  if (!written) return report(written.error());
  if (arguments.json) {
    print_json({{"calibration", arguments.calibration}});
  } else {
    print(fmt::format("{}: calibration of the simulated cameras and IMU", arguments.calibration));
  }
  return kExitSuccess;
}

/// Without a mission. False if the vehicle cannot be read, which is printed.
bool set_motion(const SuperviseArguments& arguments, SupervisorSettings& settings) {
  Diagnostics diagnostics;
  const std::optional<LoadedVehicle> vehicle = load_vehicle(arguments.vehicle, diagnostics);
  if (vehicle) settings.motion = vehicle->model.motion;
  if (!vehicle) print_diagnostics(diagnostics);
  return vehicle.has_value();
}

/// False if mission or vehicle cannot be read, which is printed. With a mission that uses no fixes
/// of a range camera, the settings get no map.
bool set_motion_and_map(const SuperviseArguments& arguments, SupervisorSettings& settings) {
  const tl::expected<std::optional<link::Key>, int> key = key_of(arguments.link.key);
  if (!key) return false;
  Diagnostics diagnostics;
  const std::optional<SupervisedDive> dive = load_supervised(arguments, *key, diagnostics);
  if (!dive) {
    print_diagnostics(diagnostics);
    return false;
  }
  settings.motion = dive->motion;
  const Mission& mission = dive->mission;
  if (!uses_map_fixes(mission) || maps_with_stereo(mission)) {
    note(
        fmt::format("dive: {}: it uses no map fixes from a range camera: the exit path will be "
                    "followed by dead reckoning",
                    arguments.mission));
    return true;
  }
  settings.map.emplace();
  settings.map->surface = std::make_shared<const planning::MapSurface>(dive->world);
  settings.map->digest = planning::world_digest(dive->world);
  settings.map->noise = mapper_options(mission, {}).noise;
  settings.map->fixes = map_fix_options(mission, dive->motion);
  return true;
}

}  // namespace

int run_sim(const SimArguments& arguments) {
  VehicleSettings settings;
  settings.seed = arguments.seed;
  settings.lockstep = arguments.link.lockstep;
  settings.max_seconds = arguments.max_seconds;
  const std::optional<std::vector<Fault>> faults = parse_faults(arguments.faults);
  if (!faults) return kExitUsage;
  settings.faults = *faults;
  if (!parse_disturbances(arguments, settings)) return kExitUsage;
  const std::optional<Place> place = find_place(arguments);
  if (!place) return kExitUsage;
  const std::optional<vehicle::Conditions> conditions =
      parse_conditions(arguments.conditions, place->conditions);
  if (!conditions) return kExitUsage;
  settings.conditions = *conditions;
  settings.range_camera = place->range_camera;
  if (arguments.range_camera) settings.range_camera.emplace();
  if (const std::string& water =
          arguments.simulated_water.empty() ? place->water : arguments.simulated_water;
      !water.empty()) {
    settings.cameras = parse_water(water);
    if (!settings.cameras) return kExitUsage;
    settings.cameras->tags = place->tags;
  }
  if (!arguments.calibration.empty()) return write_calibration(arguments, settings);
  const vehicle::Model model = load_vehicle();
  std::optional<link::Bus> bus = open_link(arguments.link, link::Role::kVehicle);
  if (!bus) return kExitUsage;
  FastClock clock(arguments.link.time_factor);
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  note(fmt::format("dive: the vehicle lies at its start in {} and waits for `dive run --lcm`",
                   arguments.mission));
  const VehicleReport report = simulate_vehicle(place->world, model, place->start_X_WB, settings,
                                                *bus, clock, [] { return !interrupted; });
  if (arguments.json) {
    print_json_report(report);
  } else {
    print_report(report);
  }
  return report.collisions.empty() && report.ended != "time" ? kExitSuccess : kExitFailed;
}

int run_supervise(const SuperviseArguments& arguments) {
  request_realtime_priority();
  SupervisorSettings settings;
  settings.command_timeout_s = arguments.command_timeout_s;
  const bool is_set = arguments.mission.empty() ? set_motion(arguments, settings)
                                                : set_motion_and_map(arguments, settings);
  if (!is_set) return kExitUsage;
  std::optional<link::Bus> bus = open_link(arguments.link, link::Role::kSupervisor);
  if (!bus) return kExitUsage;
  FastClock clock(arguments.link.time_factor);
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  const SupervisorReport report = supervise(
      settings, *bus, clock, [](const std::string& line) { note("dive: " + line); },
      [] { return !interrupted; });
  if (arguments.json) {
    print_json({{"took_over", report.took_over},
                {"silent_s", report.silent_s},
                {"holds", report.holds},
                {"given_back", report.given_back},
                {"followed", report.followed},
                {"fixes", report.fixes},
                {"blindly", report.blindly},
                {"surfaced", report.surfaced},
                {"presumed", report.presumed},
                {"restarts", report.restarts},
                {"second_executive", report.second_executive},
                {"refused", report.refused}});
  }
  return report.took_over ? kExitFailed : kExitSuccess;
}

int run_topside(const TopsideArguments& arguments) {
  std::optional<link::Bus> bus = open_link(arguments.link, link::Role::kTopside);
  if (!bus) return kExitUsage;
  SteadyClock clock;
  if (!arguments.command) return print_status(*bus, clock, arguments);
  const tl::expected<link::RequestResult, std::string> result =
      ask(*arguments.command, *bus, arguments.link.url, clock, arguments.timeout_s);
  if (!result) {
    complain(result.error());
    return kExitFailed;
  }
  const bool accepted = *result == link::RequestResult::kAccepted;
  const char* const command = to_string(*arguments.command);
  if (arguments.json) {
    print_json({{"command", command}, {"accepted", accepted}, {"result", link::describe(*result)}});
  } else {
    print(fmt::format("{}: {}", command, link::describe(*result)));
  }
  return accepted ? kExitSuccess : kExitFailed;
}

int run_key(const KeyArguments& arguments) {
  create_folder_of(arguments.path);
  const tl::expected<void, OutputError> written =
      link::write_key(arguments.path, link::new_key(), existing(arguments.force));
  if (!written) return report(written.error());
  if (arguments.json) {
    print_json({{"key", arguments.path}});
    return kExitSuccess;
  }
  print(fmt::format("{}: a new key; copy it to the vehicle, and keep it unreadable for others",
                    arguments.path));
  return kExitSuccess;
}

}  // namespace dive::mission
