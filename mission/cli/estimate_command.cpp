// Runs an estimator on a recording and reports its error if there is ground truth.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/clock.h"
#include "estimation/dataset/asl_dataset.h"
#include "estimation/dataset/dataset_run.h"
#include "estimation/dataset/recording_check.h"
#include "estimation/dataset/trajectory.h"
#include "estimation/dataset/trajectory_error.h"
#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/cli/work_progress.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;
using estimation::Alignment;
using estimation::DatasetRun;
using estimation::Recording;
using estimation::RelativeError;
using estimation::Trajectory;
using Estimates = std::vector<estimation::StateEstimate>;

constexpr double kStretches_m[] = {1.0, 5.0, 10.0, 25.0, 50.0, 100.0};

struct Accuracy {
  double distance_m = 0.0;  // ground-truth distance if present, else estimated
  std::optional<estimation::AbsoluteError> yaw_aligned;
  std::optional<estimation::AbsoluteError> rigidly_aligned;
  std::optional<double> drift_percent;
  std::optional<estimation::Nees> nees;
  std::vector<RelativeError> relative;
};

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

Trajectory estimated(const Estimates& estimates) {
  Trajectory trajectory;
  for (const estimation::StateEstimate& e : estimates) trajectory.push_back({e.utime, e.X_WB});
  return trajectory;
}

Accuracy accuracy_of(const Recording& dataset, const Estimates& estimates) {
  const Trajectory estimate = estimated(estimates);
  Accuracy accuracy;
  accuracy.distance_m = estimation::length_of(estimate);
  const Trajectory truth = estimation::true_trajectory(dataset);
  const std::vector<estimation::PosePair> pairs = estimation::pair_up(estimate, truth);
  if (pairs.empty()) return accuracy;

  Trajectory followed;
  for (const estimation::PosePair& pair : pairs) followed.push_back({pair.utime, pair.truth});
  accuracy.distance_m = estimation::length_of(followed);
  if (const auto X = estimation::align(pairs, Alignment::kYawAndTranslation)) {
    accuracy.yaw_aligned = estimation::absolute_error(pairs, *X);
  }
  if (const auto X = estimation::align(pairs, Alignment::kRigid)) {
    accuracy.rigidly_aligned = estimation::absolute_error(pairs, *X);
  }
  if (!dataset.has_true_attitude) return accuracy;
  accuracy.drift_percent = estimation::drift_percent(pairs);
  accuracy.nees = estimation::nees(estimates, truth);
  for (const double distance : kStretches_m) {
    const RelativeError error = estimation::relative_error(pairs, distance);
    if (error.stretches > 0) accuracy.relative.push_back(error);
  }
  return accuracy;
}

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json to_json(const Accuracy& accuracy) {
  Json relative = Json::array();
  for (const RelativeError& error : accuracy.relative) {
    relative.push_back({{"distance_m", error.distance_m},
                        {"mean_m", error.mean_m},
                        {"percent", error.percent},
                        {"mean_deg", error.mean_deg}});
  }
  const auto rmse = [](const std::optional<estimation::AbsoluteError>& error) {
    return error ? Json(error->rmse_m) : Json(nullptr);
  };
  return {{"ate_m", rmse(accuracy.yaw_aligned)},
          {"ate_rigid_m", rmse(accuracy.rigidly_aligned)},
          {"drift_percent", or_null(accuracy.drift_percent)},
          {"rpe", std::move(relative)},
          {"nees_position", accuracy.nees ? Json(accuracy.nees->position) : Json(nullptr)},
          {"nees_orientation", accuracy.nees ? Json(accuracy.nees->orientation) : Json(nullptr)}};
}

Json to_json(const DatasetRun& run, const Accuracy& accuracy, double duration_s) {
  const Timing timing = timing_of(run.frame_ms);
  Json all = {
      {"frames", run.frames}, {"duration_s", duration_s}, {"distance_m", accuracy.distance_m}};
  all.update(to_json(accuracy));
  all.update({{"ms_per_frame", {{"mean", timing.mean_ms}, {"p99", timing.p99_ms}}},
              {"estimates", run.estimates.size()},
              {"rejected_images", run.refused},
              {"poor_images", run.poor},
              {"lost_images", run.lost},
              {"mean_features", run.mean_features},
              {"diverged", run.diverged}});
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
              {"worst_closure_m", or_null(worst)}};
  all.update(to_json(accuracy));
  all["ms_per_keyframe"] = {{"mean", timing.mean_ms}, {"p99", timing.p99_ms}};
  return all;
}

void print_accuracy(const Accuracy& accuracy) {
  if (accuracy.yaw_aligned) {
    print(fmt::format(
        "  ATE      {:.3f} m, {:.2f} deg (yaw and translation aligned), at most "
        "{:.3f} m",
        accuracy.yaw_aligned->rmse_m, accuracy.yaw_aligned->rmse_deg, accuracy.yaw_aligned->max_m));
  }
  if (accuracy.rigidly_aligned) {
    print(fmt::format("           {:.3f} m (rigidly aligned)", accuracy.rigidly_aligned->rmse_m));
  }
  for (const RelativeError& error : accuracy.relative) {
    print(fmt::format("  RPE      {:.3f} m ({:.2f} %), {:.2f} deg in {:g} m", error.mean_m,
                      error.percent, error.mean_deg, error.distance_m));
  }
  if (accuracy.drift_percent) print(fmt::format("  drift    {:.2f} %", *accuracy.drift_percent));
  if (accuracy.nees) {
    print(fmt::format("  NEES     position {:.2f}, orientation {:.2f} (3 when honest)",
                      accuracy.nees->position, accuracy.nees->orientation));
  }
}

void print_report(const EstimateArguments& arguments, const DatasetRun& run,
                  const Accuracy& accuracy, double duration_s) {
  const Timing timing = timing_of(run.frame_ms);
  print(fmt::format("{}: {} pictures in {:.1f} s, {} estimates along {:.2f} m", arguments.folder,
                    run.frames, duration_s, run.estimates.size(), accuracy.distance_m));
  print_accuracy(accuracy);
  if (!accuracy.yaw_aligned) print("  nothing to compare: no truth, or no estimate beside it");
  print(fmt::format("  time     {:.2f} ms per picture, 99 % within {:.2f} ms", timing.mean_ms,
                    timing.p99_ms));
  if (run.refused + run.poor + run.lost > 0) {
    print(fmt::format(
        "  pictures {} refused, {} with few features, tracking lost in {}; the last: {}",
        run.refused, run.poor, run.lost, run.last_fault));
  }
}

void print_loops(const DatasetRun& run, const Accuracy& accuracy,
                 const std::optional<double>& worst) {
  const Timing timing = timing_of(run.loop_ms);
  print(fmt::format("with {} loops closed among {} keyframes, each estimate by those until then:",
                    run.closures.size(), run.keyframes));
  print_accuracy(accuracy);
  if (worst) print(fmt::format("  loops    at most {:.3f} m off the truth", *worst));
  print(fmt::format("  time     {:.2f} ms per keyframe, 99 % within {:.2f} ms", timing.mean_ms,
                    timing.p99_ms));
}

std::optional<estimation::RunOptions> options_of(const EstimateArguments& arguments) {
  estimation::RunOptions options;
  options.estimator = arguments.estimator == "primitive"
                          ? estimation::EstimatorKind::kPrimitive
                          : estimation::EstimatorKind::kVisualInertial;
  options.start = arguments.init == "truth"    ? estimation::RunStart::kTruth
                  : arguments.init == "motion" ? estimation::RunStart::kMotion
                                               : estimation::RunStart::kRest;
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

// Why there is no estimate, and what to do.
std::string never_started(const estimation::RunOptions& options) {
  const char* const what =
      options.estimator == estimation::EstimatorKind::kPrimitive
          ? "no depth and IMU samples at the time of an image"
      : options.start == estimation::RunStart::kRest
          ? "the vehicle was never at rest for half a second; initialise it in motion, or from the "
            "ground truth: --init motion, --init truth"
          : "the samples that it starts from are missing";
  return fmt::format("the estimator has never started: {}", what);
}

}  // namespace

int run_estimate(const EstimateArguments& arguments) {
  const auto options = options_of(arguments);
  if (!options) return kExitUsage;
  auto dataset = estimation::read_asl_dataset(arguments.folder);
  if (!dataset) {
    complain(dataset.error());
    return kExitUsage;
  }
  if (dataset->diagnostics.ok()) estimation::check_recording(*dataset, *options);
  print_diagnostics(dataset->diagnostics);
  if (!dataset->diagnostics.ok()) return kExitUsage;
  tl::expected<Result, int> file = open_result(arguments.output, arguments.force);
  if (!file) return file.error();
  SteadyClock clock;
  WorkProgress progress(clock, "estimating", arguments.json);
  const auto run =
      estimation::run_on(*dataset, *options, clock, [&](double share) { progress.show(share); });
  progress.clear();
  if (!run) {
    complain(run.error());
    return kExitUsage;
  }
  if (*file) {
    const Estimates& estimates = options->loops ? run->corrected : run->estimates;
    const int status = write_result(*file, estimation::to_tum(estimated(estimates)));
    if (status != kExitSuccess) return status;
  }
  const auto& images = dataset->cameras[0].images;
  const double duration_s = to_seconds(images.back().utime - images.front().utime);
  const Accuracy accuracy = accuracy_of(*dataset, run->estimates);
  std::optional<Accuracy> with_loops;
  if (options->loops) with_loops = accuracy_of(*dataset, run->corrected);
  const std::optional<double> worst = worst_closure(*dataset, *run);
  if (arguments.json) {
    Json all = to_json(*run, accuracy, duration_s);
    all["warnings"] = to_json(dataset->diagnostics);
    if (with_loops) all["loops"] = loops_to_json(*run, *with_loops, worst);
    print_json(all);
  } else {
    print_report(arguments, *run, accuracy, duration_s);
    if (with_loops) print_loops(*run, *with_loops, worst);
  }
  if (run->estimates.empty()) {
    complain(never_started(*options));
    return kExitUsage;
  }
  if (!run->diverged.empty()) {
    complain(fmt::format("the filter has diverged: {}", run->diverged));
    return kExitFailed;
  }
  return kExitSuccess;
}

}  // namespace dive::mission
