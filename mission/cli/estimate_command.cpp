// Runs an estimator on a recording and reports its error if there is ground truth.

#include <algorithm>
#include <array>
#include <ctime>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "common/clock.h"
#include "common/input_file.h"
#include "estimation/dataset/asl_dataset.h"
#include "estimation/dataset/bag/bag_recording.h"
#include "estimation/dataset/bag/calibration_file.h"
#include "estimation/dataset/dataset_run.h"
#include "estimation/dataset/recording_check.h"
#include "estimation/dataset/trajectory.h"
#include "estimation/dataset/trajectory_error.h"
#include "mission/cli/commands.h"
#include "mission/cli/estimate_accuracy.h"
#include "mission/cli/estimate_comparison.h"
#include "mission/cli/estimate_health.h"
#include "mission/cli/json.h"
#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/cli/work_progress.h"

namespace dive::mission {
namespace {

// Processor time of this process: other processes do not lengthen it.
class ProcessorClock final : public Clock {
 public:
  [[nodiscard]] Utime now() override {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<Utime>(time.tv_sec) * 1'000'000 + time.tv_nsec / 1'000;
  }
};

using Json = nlohmann::ordered_json;
using estimation::DatasetRun;
using estimation::Recording;
using estimation::Trajectory;
using Estimates = std::vector<estimation::StateEstimate>;

struct Timing {
  double mean_ms = 0.0;
  double p99_ms = 0.0;
};

Timing timing_of(std::vector<double> ms) {
  Timing timing;
  if (ms.empty()) return timing;
  for (const double value : ms) timing.mean_ms += value / static_cast<double>(ms.size());
  std::sort(ms.begin(), ms.end());
  timing.p99_ms = ms[(ms.size() - 1) * 99 / 100];
  return timing;
}

Json cameras_to_json(const std::vector<CameraModel>& cameras) {
  Json all = Json::array();
  for (const CameraModel& camera : cameras) {
    all.push_back({{"fx", camera.fx},
                   {"fy", camera.fy},
                   {"cx", camera.cx},
                   {"cy", camera.cy},
                   {"refractive_index", camera.refractive_index}});
  }
  return all;
}

Json run_to_json(const DatasetRun& run, const Accuracy& accuracy, double duration_s) {
  const Timing timing = timing_of(run.frame_ms);
  Json all = {
      {"frames", run.frames}, {"duration_s", duration_s}, {"distance_m", accuracy.distance_m}};
  all.update(to_json(accuracy));
  all.update({{"ms_per_frame", {{"mean", timing.mean_ms}, {"p99", timing.p99_ms}}},
              {"estimates", run.estimates.size()},
              {"rejected_images", run.health.images.rejected()},
              {"poor_images", run.health.images.few_features},
              {"lost_images", run.health.images.lost},
              {"mean_features", run.mean_features},
              {"began_s", run.estimates.empty() ? Json(nullptr) : Json(run.began_s)},
              {"waits_for", run.waits_for},
              {"cameras", cameras_to_json(run.cameras)},
              {"diverged", run.health.failure}});
  return all;
}

// The largest error of a loop closure, m.
std::optional<double> worst_closure(const Recording& dataset, const DatasetRun& run) {
  const auto errors =
      estimation::closure_errors(run.closures, estimation::true_trajectory(dataset));
  if (errors.empty() || !dataset.has_true_attitude) return std::nullopt;
  return *std::max_element(errors.begin(), errors.end());
}

Json loops_to_json(const DatasetRun& run, const Accuracy& accuracy,
                   const std::optional<double>& worst) {
  const Timing timing = timing_of(run.loop_ms);
  Json all = {{"keyframes", run.keyframes},
              {"closures", run.closures.size()},
              {"worst_closure_m", worst ? Json(*worst) : Json(nullptr)}};
  all.update(to_json(accuracy));
  all["ms_per_keyframe"] = {{"mean", timing.mean_ms}, {"p99", timing.p99_ms}};
  return all;
}

// Those whose intrinsics were estimated.
void print_cameras(const Recording& recording, const DatasetRun& run) {
  for (std::size_t i = 0; i < run.cameras.size(); ++i) {
    const CameraModel& given = recording.cameras[i].model;
    const CameraModel& found = run.cameras[i];
    const bool has_port = found.refractive_index != given.refractive_index;
    if (found.fx == given.fx && !has_port) continue;
    print(fmt::format("  camera {} focal lengths {:.2f}, {:.2f}, centre {:.2f}, {:.2f}{}", i,
                      found.fx, found.fy, found.cx, found.cy,
                      has_port ? fmt::format(", refractive index {:.4f}", found.refractive_index)
                               : std::string()));
  }
}

void print_report(const EstimateArguments& arguments, const DatasetRun& run,
                  const Accuracy& accuracy, double duration_s) {
  const Timing timing = timing_of(run.frame_ms);
  print(fmt::format("{}: {} images in {:.1f} s, {} estimates along {:.2f} m", arguments.folder,
                    run.frames, duration_s, run.estimates.size(), accuracy.distance_m));
  print_accuracy(accuracy);
  if (!run.estimates.empty()) {
    print(fmt::format("  began    {:.2f} s after the first image", run.began_s));
  }
  if (!accuracy.yaw_aligned) print("  nothing to compare: no truth, or no estimate beside it");
  print(fmt::format("  time     {:.2f} ms of processor per image, 99 % within {:.2f} ms",
                    timing.mean_ms, timing.p99_ms));
}

void print_loops(const DatasetRun& run, const Accuracy& accuracy,
                 const std::optional<double>& worst) {
  const Timing timing = timing_of(run.loop_ms);
  print(fmt::format("with {} loops closed among {} keyframes, each estimate by those until then:",
                    run.closures.size(), run.keyframes));
  print_accuracy(accuracy);
  if (worst) print(fmt::format("  loops    at most {:.3f} m off the truth", *worst));
  print(fmt::format("  time     {:.2f} ms of processor per keyframe, 99 % within {:.2f} ms",
                    timing.mean_ms, timing.p99_ms));
}

std::optional<estimation::RunOptions> options_of(const EstimateArguments& arguments) {
  estimation::RunOptions options;
  options.estimator = arguments.estimator == "primitive"
                          ? estimation::EstimatorKind::kPrimitive
                          : estimation::EstimatorKind::kVisualInertial;
  options.start =
      arguments.init == "truth" ? estimation::RunStart::kTruth : estimation::RunStart::kImages;
  options.mono = arguments.mono;
  options.use_depth = !arguments.no_depth;
  options.loops = arguments.loops;
  options.speed = arguments.speed;
  options.seed = arguments.seed;
  if (const std::string why = options.validate(); !why.empty()) {
    complain(why);
    return std::nullopt;
  }
  return options;
}

struct Inputs {
  Recording recording;
  Trajectory other;  // another estimator's; empty: none
};

// The file to read: a folder of ROS 2's recorder contains one.
tl::expected<std::string, std::string> file_in(const std::string& path) {
  namespace fs = std::filesystem;
  if (!is_folder(path) || is_folder(fs::path(path) / "mav0") ||
      is_folder(fs::path(path) / "cam0")) {
    return path;
  }
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path, error)) {
    const fs::path extension = entry.path().extension();
    if (extension == ".mcap" || extension == ".bag" || extension == ".db3" ||
        extension == ".zstd") {
      found.push_back(entry.path().string());
    }
  }
  if (found.empty()) return path;
  if (found.size() == 1) return found.front();
  return tl::make_unexpected(
      fmt::format("{}: it has {} bags; give one of them", path, found.size()));
}

// A folder in the ASL format. A calibration that is given, or that is found beside one without
// sensor.yaml files, is used instead of them.
tl::expected<Recording, std::string> read_folder(const std::string& path,
                                                 const EstimateArguments& arguments) {
  if (!arguments.preset.empty() || !arguments.topics.empty()) {
    return tl::make_unexpected(path + ": --preset and --topic apply to a bag, and this is not one");
  }
  std::vector<std::string> files = arguments.calibration;
  Diagnostic found;
  if (files.empty() && estimation::lacks_asl_calibration(path)) {
    files = estimation::calibration_beside(path);
    if (files.empty()) {
      return tl::make_unexpected(path +
                                 ": imu0 has no sensor.yaml; give the calibration of cameras and "
                                 "IMU with --calibration");
    }
    found.message = fmt::format("calibration: {}", fmt::join(files, ", "));
  }
  if (files.empty()) return estimation::read_asl_dataset(path);
  auto calibration = estimation::read_calibration(files);
  if (!calibration) return tl::make_unexpected(calibration.error());
  if (!found.message.empty()) {
    found.code = "CALIBRATION";
    found.severity = Severity::kNote;
    found.file = path;
    calibration->sensors.diagnostics.add(std::move(found));
  }
  return estimation::read_asl_dataset(path, std::move(calibration->sensors));
}

tl::expected<Recording, std::string> read_recording(const EstimateArguments& arguments) {
  const auto file = file_in(arguments.folder);
  if (!file) return tl::make_unexpected(file.error());
  const std::string& path = *file;
  if (is_folder(path)) return read_folder(path, arguments);
  if (const auto opened = open_input(path); !opened) {
    return tl::make_unexpected(fmt::format("{}: {}", path, opened.error()));
  }
  estimation::BagOptions options;
  options.calibration = arguments.calibration;
  options.preset = arguments.preset;
  for (const std::string& given : arguments.topics) {
    const std::size_t equals = given.find('=');
    const std::string sensor = given.substr(0, equals);
    constexpr std::array kSensors = {"imu", "cam0", "cam1", "depth", "velocity", "truth"};
    if (equals == std::string::npos ||
        std::find(kSensors.begin(), kSensors.end(), sensor) == kSensors.end()) {
      return tl::make_unexpected(
          fmt::format("--topic {}: SENSOR=NAME is expected, SENSOR one of {}", given,
                      fmt::join(kSensors, ", ")));
    }
    options.topics[sensor] = given.substr(equals + 1);
  }
  if (options.calibration.empty()) {
    return tl::make_unexpected(path + ": a bag has no calibration; give it with --calibration");
  }
  return estimation::read_bag(path, options);
}

// Prints what is wrong; nothing if the estimator cannot run.
std::optional<Inputs> read_inputs(const EstimateArguments& arguments,
                                  const estimation::RunOptions& options) {
  auto recording = read_recording(arguments);
  if (!recording) {
    complain(recording.error());
    return std::nullopt;
  }
  if (recording->diagnostics.ok()) estimation::check_recording(*recording, options);
  print_diagnostics(recording->diagnostics);
  if (!recording->diagnostics.ok()) return std::nullopt;
  Inputs inputs{std::move(*recording), {}};
  if (arguments.against.empty()) return inputs;
  auto other = read_other(arguments.against, inputs.recording);
  if (!other) {
    complain(other.error());
    return std::nullopt;
  }
  inputs.other = std::move(*other);
  return inputs;
}

void report_run(const EstimateArguments& arguments, const estimation::RunOptions& options,
                const Inputs& inputs, const DatasetRun& run) {
  const Recording& recording = inputs.recording;
  const auto& images = recording.cameras[0].images;
  const double duration_s = to_seconds(images.back().utime - run.begin);
  const Accuracy accuracy = accuracy_of(recording, run.estimates);
  std::optional<Accuracy> with_loops;
  if (arguments.loops) with_loops = accuracy_of(recording, run.corrected);
  const std::optional<double> worst = worst_closure(recording, run);
  std::optional<Comparison> comparison;
  if (!inputs.other.empty()) {
    const Estimates& ours = arguments.loops ? run.corrected : run.estimates;
    comparison = compare(recording, trajectory_of(ours), inputs.other);
  }
  if (arguments.json) {
    Json all = run_to_json(run, accuracy, duration_s);
    all.update(health_to_json(recording, options, run));
    all["warnings"] = to_json(recording.diagnostics);
    if (with_loops) all["loops"] = loops_to_json(run, *with_loops, worst);
    if (comparison) all["against"] = to_json(*comparison, arguments.against);
    print_json(all);
    return;
  }
  print_report(arguments, run, accuracy, duration_s);
  print_cameras(recording, run);
  print_health(recording, options, run);
  if (with_loops) print_loops(run, *with_loops, worst);
  if (comparison) print_comparison(*comparison, arguments.against);
}

}  // namespace

int run_estimate(const EstimateArguments& arguments) {
  const auto options = options_of(arguments);
  if (!options) return kExitUsage;
  std::optional<Inputs> inputs = read_inputs(arguments, *options);
  if (!inputs) return kExitUsage;
  tl::expected<Result, int> file = open_result(arguments.output, arguments.force);
  if (!file) return file.error();
  SteadyClock clock;
  WorkProgress progress(clock, "estimating", arguments.json);
  ProcessorClock processor;
  const auto run = estimation::run_on(inputs->recording, *options, processor,
                                      [&](double share) { progress.show(share); });
  progress.clear();
  if (!run) {
    complain(run.error());
    return kExitUsage;
  }
  print_diagnostics(run->diagnostics);
  for (const Diagnostic& warning : run->diagnostics.list()) {
    inputs->recording.diagnostics.add(warning);
  }
  if (*file) {
    const Estimates& estimates = options->loops ? run->corrected : run->estimates;
    const int status = write_result(*file, estimation::to_tum(trajectory_of(estimates)));
    if (status != kExitSuccess) return status;
  }
  report_run(arguments, *options, *inputs, *run);
  if (run->estimates.empty()) {
    complain(fmt::format("the estimator has never begun: it waits for {}",
                         run->waits_for.empty() ? "depth and IMU samples" : run->waits_for));
    return kExitUsage;
  }
  if (!run->health.failure.empty()) {
    complain(fmt::format("no estimate was trusted since: {}", run->health.failure));
    return kExitFailed;
  }
  if (options->estimator == estimation::EstimatorKind::kVisualInertial &&
      run->health.trusted == 0) {
    complain(fmt::format("no estimate was trusted{}{}", run->health.suspicion.empty() ? "" : ": ",
                         run->health.suspicion));
    return kExitFailed;
  }
  return kExitSuccess;
}

}  // namespace dive::mission
