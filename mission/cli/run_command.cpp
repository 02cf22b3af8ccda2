#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "estimation/dataset/asl_dataset.h"
#include "estimation/dataset/dataset_run.h"
#include "estimation/visual_inertial/pipeline/vision_pipeline.h"
#include "mission/check/check.h"
#include "mission/cli/bundle_file.h"
#include "mission/cli/commands.h"
#include "mission/cli/dive_progress.h"
#include "mission/cli/drawing.h"
#include "mission/cli/json.h"
#include "mission/cli/link_report.h"
#include "mission/cli/loading.h"
#include "mission/cli/open_link.h"
#include "mission/cli/output.h"
#include "mission/cli/recording.h"
#include "mission/cli/service_notifier.h"
#include "mission/cli/stop_signals.h"
#include "mission/cli/terminal.h"
#include "mission/link/linked_dive.h"
#include "mission/onboard/stereo_mapping.h"
#include "mission/record/dataset_recorder.h"
#include "mission/simulation/simulated_conditions.h"
#include "mission/simulation/simulated_dive.h"
#include "planning/mapping/save_map.h"
#include "planning/world/scene.h"
#include "vehicle/link/bus.h"

namespace dive::mission {
namespace {

void print_verdict(const DiveResult& result, const std::string& log) {
  print(fmt::format("{}: {} in state {}{}", result.outcome == "success" ? "SUCCESS" : "NOT DONE",
                    result.outcome, result.final_state,
                    result.cause.empty() ? "" : " (" + result.cause + ")"));
  print(fmt::format("  {:.0f} s, {:.1f} m swum, {} plan(s) of which {} replan(s), {:.1f} Wh",
                    result.duration_s, result.distance_m, result.plans, result.replans,
                    result.energy_wh));
  print(fmt::format("  {} collision(s); final position error {:.2f} m, one sigma {:.2f} m",
                    result.collisions.size(), result.final_error_m, result.final_sigma_m));
  print_contacts(result.nearest, result.collisions);
  print("  log " + log);
}

void print_linked(const LinkedResult& result, const std::string& log, bool with_stats) {
  print(fmt::format("{}: {} in state {}{}", result.outcome == "success" ? "SUCCESS" : "NOT DONE",
                    result.outcome, result.final_state,
                    result.cause.empty() ? "" : " (" + result.cause + ")"));
  print(fmt::format("  {:.0f} s, {:.1f} m swum as estimated, {} plan(s) of which {} replan(s)",
                    result.duration_s, result.distance_m, result.plans, result.replans));
  if (with_stats) {
    for (const std::string& line : describe(result.stats)) print("  " + line);
  }
  for (const ServiceFailure& failure : result.service_failures) {
    print(fmt::format("  an error in dive's own {} at {:.1f} s: {}; please report it with the log",
                      failure.service, failure.time_s, failure.message));
  }
  print("  log " + log);
}

/// Writes the map made in an unknown environment beside the log, under the next free number; no
/// name if there is no map. Prints an error and returns the exit status if it cannot be written.
tl::expected<std::optional<std::string>, int> keep_map(const std::string& log,
                                                       const planning::ObservedMap& map,
                                                       const std::vector<Eigen::Vector3f>& points,
                                                       const LoadedMission& loaded) {
  if (map.pieces() == 0) return std::nullopt;
  const std::string base = std::filesystem::path(log).replace_extension(".map").string();
  for (int number = newest_numbered(base) + 1;; ++number) {
    const std::string name = numbered(base, number);
    const tl::expected<void, OutputError> saved = planning::save_map(
        name, map, points, "observed on a dive of " + loaded.mission.id + ", dive " DIVE_VERSION,
        Existing::kRefuse);
    if (saved) return name + ".sdf";
    if (saved.error().kind == OutputError::Kind::kExists) continue;
    complain("the map is not kept:");
    return tl::unexpected(report(saved.error()));
  }
}

/// Names of the objects of the known map that were found to be gone.
std::vector<std::string> absent_names(const planning::World& known,
                                      const planning::ObservedMap& map) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < known.obstacles.size(); ++i) {
    const std::string& name = known.obstacles[i].name;  // the pieces of a mesh share one
    if (!map.absent().contains(static_cast<int>(i)) || (!names.empty() && names.back() == name))
      continue;
    names.push_back(name);
  }
  return names;
}

void add_map(nlohmann::ordered_json& json, const std::optional<std::string>& file,
             const planning::ObservedMap& map, const LoadedMission& loaded) {
  if (file) json["map"] = *file;
  if (loaded.mission.trusts_absence) json["absent_objects"] = absent_names(loaded.world, map);
}

void print_map(const std::optional<std::string>& file, const planning::ObservedMap& map,
               const LoadedMission& loaded) {
  if (file) print(fmt::format("  map {} ({} pieces)", *file, map.pieces()));
  for (const std::string& name : absent_names(loaded.world, map)) {
    print(fmt::format("  gone from the map: {}", name));
  }
}

const std::string& water_of(const RunArguments& arguments, const Mission& mission) {
  return arguments.simulated_water.empty() ? mission.simulated_water : arguments.simulated_water;
}

/// Sets up the recording of the dive as a dataset. Prints an error and returns the exit status on
/// failure.
int record_dataset(const RunArguments& arguments, const LoadedMission& loaded,
                   DiveSettings& settings, std::optional<DatasetRecorder>& dataset) {
  settings.conditions.inertial_unit = vehicle::ImuNoise{};
  tl::expected<DatasetRecorder, OutputError> created = DatasetRecorder::create(
      arguments.record, existing(arguments.force), simulated_world(loaded.world, settings),
      *settings.cameras, settings.conditions, settings.seed,
      fmt::format("{} dived with seed {} in simulated {} by dive " DIVE_VERSION, loaded.mission.id,
                  settings.seed, water_of(arguments, loaded.mission)));
  if (!created) return report(created.error());
  dataset.emplace(std::move(*created));
  settings.sensor_observer =
      [&dataset](const vehicle::SensorSamples& samples, const vehicle::GroundTruth& truth,
                 const std::optional<Pose>& X_WD) { dataset->observe(samples, truth, X_WD); };
  return kExitSuccess;
}

/// Prints an error and returns the exit status if a part of the dataset was lost.
int close_dataset(std::optional<DatasetRecorder>& dataset) {
  if (!dataset) return kExitSuccess;
  const tl::expected<void, OutputError> closed = dataset->close();
  return closed ? kExitSuccess : report(closed.error());
}

/// The plan of the mission, to which the dive is added.
DiveDrawing planned_drawing(const LoadedMission& loaded, const DiveSettings& settings) {
  const planning::Scene scene(loaded.world);
  return drawing_of_plan(
      fmt::format("{}: dive with seed {}", loaded.mission.id, settings.seed), loaded.world,
      loaded.model.hull, loaded.mission.limits.clearance.value,
      plan_route(nominal_route(loaded.mission, scene), loaded.mission, loaded.world,
                 loaded.model.hull, settings.planner, settings.seed));
}

int simulate(const RunArguments& arguments, const LoadedMission& loaded, DiveSettings settings,
             StopSignals& signals) {
  settings.cameras = parse_water(water_of(arguments, loaded.mission));
  if (!settings.cameras) return kExitUsage;
  tl::expected<Result, int> svg = open_result(arguments.svg, arguments.force);
  if (!svg) return svg.error();
  tl::expected<DiveRecording, int> recording = DiveRecording::open(arguments, loaded);
  if (!recording) return recording.error();
  settings.seed = recording->seed();
  settings.resume = recording->resume();
  settings.local_abort = [&signals] { return signals.take(); };
  std::optional<DatasetRecorder> dataset;
  if (!arguments.record.empty()) {
    const int status = record_dataset(arguments, loaded, settings, dataset);
    if (status != kExitSuccess) return status;
  }
  DiveDrawing drawing = *svg ? planned_drawing(loaded, settings) : DiveDrawing{};
  DrawingRecorder recorder(drawing);
  DiveResult result;
  {
    DiveProgress progress;
    result = simulate_dive(
        loaded.mission, loaded.world, loaded.model, settings,
        [&](const StepInputs& inputs, const StepOutputs& outputs, const vehicle::GroundTruth& truth,
            const TickContacts& contacts) {
          recording->write(inputs, outputs, truth_record(truth, contacts));
          if (!arguments.json) progress.observe(inputs, outputs);
          if (*svg) recorder.observe(inputs, outputs, truth, contacts.begun);
        },
        [&](const Executive& executive, const StepOutputs& outputs) {
          recording->keep(executive, outputs);
        });
  }
  signals.end_dive();
  const int dataset_status = close_dataset(dataset);
  recording->close();
  const tl::expected<std::optional<std::string>, int> kept =
      keep_map(recording->log_path(), result.observed_map, result.observed_points, loaded);
  const std::optional<std::string> map = kept.value_or(std::nullopt);
  if (arguments.json) {
    nlohmann::ordered_json json = to_json(result);
    if (dataset) json["dataset"] = arguments.record;
    json["log"] = recording->log_path();
    json["seed"] = settings.seed;
    add_map(json, map, result.observed_map, loaded);
    print_json(json);
  } else {
    print_verdict(result, recording->log_path());
    print_map(map, result.observed_map, loaded);
    if (dataset) {
      print(fmt::format("  dataset {} ({} stereo pairs)", arguments.record, dataset->pairs()));
    }
  }
  const int svg_status = *svg ? write_result(*svg, render_svg(drawing)) : kExitSuccess;
  if (dataset_status != kExitSuccess || svg_status != kExitSuccess || !kept) return kExitInternal;
  return result.outcome == "success" ? kExitSuccess : kExitFailed;
}

/// Options for the cameras and the IMU from a calibration folder; prints an error and returns
/// nothing if something is wrong.
std::optional<estimation::VisionOptions> read_vision(const std::string& folder) {
  const auto sensors = estimation::read_asl_calibration(folder);
  if (!sensors) {
    complain(sensors.error());
    return std::nullopt;
  }
  estimation::VisionOptions options;
  options.filter = estimation::filter_options(*sensors, 2);
  if (const double rate_hz = sensors->cameras[0].rate_hz; rate_hz > 0.0) {
    options.period_s = 1.0 / rate_hz;
  }
  const std::string problem = sensors->cameras.size() < 2
                                  ? "the front cameras are two, and there is no folder cam1"
                                  : options.validate();
  if (problem.empty()) return options;
  complain(fmt::format("{}: {}", folder, problem));
  return std::nullopt;
}

/// Settings for a vehicle over LCM.
LinkSettings link_settings(const RunArguments& arguments) {
  LinkSettings settings;
  settings.lockstep = arguments.link.lockstep;
  return settings;
}

/// True if the cameras can do what the mission uses them for; else prints an error.
bool serve(const estimation::VisionOptions& vision, const RunArguments& arguments,
           const LoadedMission& loaded) {
  if (!maps_with_stereo(loaded.mission)) return true;
  const auto& cameras = vision.filter.cameras;
  const auto stereo = stereo_mapping(cameras[0], cameras[1], {}, false);
  if (stereo) return true;
  complain(fmt::format("{}: they map the environment, but are not a stereo pair: {}",
                       arguments.cameras, stereo.error()));
  return false;
}

void keep_and_print(const LinkedResult& result, const std::string& log_path, std::uint64_t seed,
                    const RunArguments& arguments, const LoadedMission& loaded) {
  // A map that is lost does not change the status, by which systemd knows whether to dive again.
  const std::optional<std::string> map =
      keep_map(log_path, result.observed_map, result.observed_points, loaded)
          .value_or(std::nullopt);
  if (arguments.json) {
    nlohmann::ordered_json json = to_json(result, arguments.stats);
    json["log"] = log_path;
    json["seed"] = seed;
    add_map(json, map, result.observed_map, loaded);
    print_json(json);
  } else {
    print_linked(result, log_path, arguments.stats);
    print_map(map, result.observed_map, loaded);
  }
}

int dive_linked(const RunArguments& arguments, const LoadedMission& loaded, StopSignals& signals) {
  std::optional<estimation::VisionOptions> vision;
  if (!arguments.cameras.empty()) {
    vision = read_vision(arguments.cameras);
    if (!vision || !serve(*vision, arguments, loaded)) return kExitUsage;
  }
  if (!arguments.link.lockstep) request_realtime_priority();
  // The key is read before log and journal are opened, so that these cannot take its file.
  std::optional<link::Bus> bus = open_link(arguments.link, link::Role::kExecutive);
  if (!bus) return kExitUsage;
  tl::expected<DiveRecording, int> recording = DiveRecording::open(arguments, loaded);
  if (!recording) return recording.error();
  LinkSettings settings = link_settings(arguments);
  settings.seed = recording->seed();
  settings.resume = recording->resume();
  settings.vision = vision;
  if (!bus->has_key()) {
    note(
        "dive: without --key packets are not authenticated, so abort is the only command accepted "
        "from topside");
  }
  settings.local_abort = [&signals] { return signals.take(); };
  settings.has_journaled_commands = [&recording] { return recording->has_journaled_commands(); };
  if (!settings.lockstep) settings.recording_loss = [&recording] { return recording->loss(); };
  FastClock clock(arguments.link.time_factor);
  ServiceNotifier service;
  LinkedResult result;
  {
    DiveProgress progress;
    result = dive_over_link(
        loaded.mission, loaded.world, loaded.model, settings, *bus, clock,
        [&](const StepInputs& inputs, const StepOutputs& outputs,
            const std::optional<link::Truth>& truth) {
          recording->write(inputs, outputs, truth);
          service.observe(outputs);
          if (!arguments.json) progress.observe(inputs, outputs);
        },
        [&](const Executive& executive, const StepOutputs& outputs) {
          recording->keep(executive, outputs);
        });
  }
  signals.end_dive();
  service.end_dive();
  recording->close();
  keep_and_print(result, recording->log_path(), settings.seed, arguments, loaded);
  if (result.outcome == "failure") return kExitUnfinished;
  return result.outcome == "success" ? kExitSuccess : kExitFailed;
}

/// Settings of a simulated dive; prints an error and returns nothing if something is wrong.
std::optional<DiveSettings> dive_settings(const RunArguments& arguments,
                                          const LoadedMission& loaded) {
  DiveSettings settings;
  settings.seed = arguments.seed;
  settings.world = loaded.simulated_world;
  const std::optional<std::vector<Fault>> faults = parse_faults(arguments.faults);
  if (!faults) return std::nullopt;
  settings.faults = *faults;
  if (arguments.leak_at_s >= 0.0)
    settings.faults.push_back({FaultKind::kLeak, arguments.leak_at_s});
  const std::optional<vehicle::Conditions> conditions =
      parse_conditions(arguments.conditions, simulated_conditions(loaded.mission));
  if (!conditions) return std::nullopt;
  settings.conditions = *conditions;
  if (!arguments.diver.empty()) {
    settings.diver = parse_diver(arguments.diver);
    if (!settings.diver) return std::nullopt;
  }
  return settings;
}

/// True if the options fit each other; else prints an error.
bool fit_each_other(const RunArguments& arguments) {
  const bool is_linked = !arguments.link.url.empty();
  if (is_linked &&
      (!arguments.faults.empty() || arguments.leak_at_s >= 0.0 || !arguments.conditions.empty() ||
       !arguments.svg.empty() || !arguments.record.empty() || !arguments.simulated_water.empty() ||
       !arguments.diver.empty())) {
    complain(
        "--diver, --svg, --record and --simulated-water are for the built-in simulator, and so are "
        "--fault, "
        "--leak-at and --set: with --lcm give those to dive sim");
    return false;
  }
  if (!is_linked && !arguments.cameras.empty()) {
    complain("--cameras applies to a vehicle: give --lcm URL");
    return false;
  }
  return true;
}

/// True if the mission can be dived with these options; else prints an error.
bool fit_mission(const RunArguments& arguments, const Mission& mission) {
  const bool is_linked = !arguments.link.url.empty();
  if (!is_linked && !has_simulation_map(mission)) {
    complain(
        fmt::format("{}: the environment is unknown and no simulated world is given: write "
                    "simulation_map=\"maps/NAME.sdf\" at <map>, or dive a vehicle with --lcm URL",
                    arguments.mission));
    return false;
  }
  if (!arguments.cameras.empty() && !uses_visual_inertial(mission)) {
    complain(
        fmt::format("{}: its estimator is primitive, which needs no --cameras: leave them out, or "
                    "write estimator=\"visual_inertial\"",
                    arguments.mission));
    return false;
  }
  if (is_linked && arguments.link.key.empty() && mission.abort_authority == AbortAuthority::kKey) {
    complain(
        fmt::format("{}: it accepts an abort only with the key (<operator abort=\"key\"/>): give "
                    "--key FILE",
                    arguments.mission));
    return false;
  }
  if (is_linked && arguments.cameras.empty() && uses_visual_inertial(mission)) {
    complain(
        fmt::format("{}: its estimator is visual_inertial, which needs the calibration of the "
                    "vehicle's cameras: give --cameras DIR (of a simulated vehicle: dive sim "
                    "--write-calibration DIR)",
                    arguments.mission));
    return false;
  }
  return true;
}

}  // namespace

int run_dive(const RunArguments& arguments) {
  if (!fit_each_other(arguments)) return kExitUsage;
  const tl::expected<std::optional<link::Key>, int> key = key_of(arguments.link.key);
  if (!key) return key.error();
  Diagnostics diagnostics;
  const std::optional<LoadedMission> loaded = load_dive(arguments, *key, diagnostics);
  if (!loaded) {
    print_diagnostics(diagnostics);
    if (arguments.json) print_json({{"outcome", "failure"}, {"diagnostics", to_json(diagnostics)}});
    return kExitUsage;
  }
  if (!fit_mission(arguments, loaded->mission)) return kExitUsage;
  const std::optional<DiveSettings> settings = dive_settings(arguments, *loaded);
  if (!settings) return kExitUsage;
  StopSignals signals;
  return arguments.link.url.empty() ? simulate(arguments, *loaded, *settings, signals)
                                    : dive_linked(arguments, *loaded, signals);
}

}  // namespace dive::mission
