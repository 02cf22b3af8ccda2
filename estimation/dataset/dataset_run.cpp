#include "estimation/dataset/dataset_run.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "estimation/dataset/recorded_primitive.h"
#include "estimation/dataset/recording_feed.h"
#include "estimation/dataset/run_start.h"
#include "estimation/visual_inertial/loop_closure/loop_finder.h"
#include "estimation/visual_inertial/pipeline/vision_pipeline.h"

namespace dive::estimation {
namespace {

using Failure = tl::unexpected<std::string>;

constexpr double kUsualSpeed = 0.4;        // m/s, of the primitive estimator
constexpr double kMaxRecordedSpeed = 8.0;  // m/s, beyond which an estimate has diverged
constexpr double kMemsGyroByAccel = 3e-5;  // rad/s per m/s^2: 0.015 deg/s/g
// A housing calibrated in another water, at another temperature and depth, is off by so much.
constexpr double kFocalSigma = 0.005;
constexpr double kCentreSigma = 2.0;  // pixels

// Loop closure on a recording: each keyframe is processed before the next image.
class Loops {
 public:
  Loops(const Recording& recording, bool has_depth)
      : finder_(options_of(has_depth), recording.cameras[0].model, recording.cameras[1].model) {}

  /// Adds the images of a step, if a keyframe is due; takes them out of the input then.
  void add(VisionInput& input, const VisionPipeline& pipeline, Utime init_utime, Clock& clock,
           DatasetRun& run) {
    if (init_utime != init_utime_) correction_.reset();
    init_utime_ = init_utime;
    const std::optional<StateEstimate> filter = pipeline.at_image();
    if (!filter || !input.right || !finder_.is_due(*filter, init_utime)) return;
    const Keyframe keyframe{std::move(*input.left),  std::move(*input.right), *filter,
                            pipeline.cameras_B()[0], pipeline.cameras_B()[1], init_utime};
    const Utime before = clock.now();
    auto correction = finder_.process(keyframe);
    ++run.keyframes;
    run.loop_ms.push_back(1e3 * to_seconds(clock.now() - before));
    if (!correction) return;
    correction_ = std::move(*correction);
    run.closures.push_back(correction_->closure);
  }

  [[nodiscard]] StateEstimate corrected(const StateEstimate& filter) const {
    return correction_ && filter.utime >= correction_->utime ? correction_->apply(filter) : filter;
  }

 private:
  static LoopCloserOptions options_of(bool has_depth) {
    LoopCloserOptions options;
    options.has_depth = has_depth;
    return options;
  }

  LoopFinder finder_;
  Utime init_utime_ = 0;
  std::optional<LoopCorrection> correction_;
};

void add_estimate(const StateEstimate& estimate, const FeedStep& step, DatasetRun& run) {
  if (run.estimates.empty()) run.began_s = to_seconds(step.image_utime - run.begin);
  run.estimates.push_back(estimate);
}

// The pipeline of a dive, fed from a recording.
class VisualRun {
 public:
  VisualRun(const Recording& recording, const RunOptions& options, const VisionOptions& vision,
            const VisionStart& start)
      : pipeline_(vision, start, options.seed) {
    if (options.speed && recording.velocity.empty()) {
      expected_v_B_ = Eigen::Vector3d(*options.speed, 0.0, 0.0);
    }
    if (options.loops) loops_.emplace(recording, options.use_depth && !recording.depth.empty());
  }

  void step(FeedStep step, Clock& clock, DatasetRun& run) {
    step.input.expected_v_B = expected_v_B_;
    const Utime before = clock.now();
    const VisionEstimate vision = pipeline_.step(step.input);
    const double ms = 1e3 * to_seconds(clock.now() - before);
    const bool is_new = run.health.add(pipeline_, vision, step);
    run.waits_for = vision.estimate.valid ? std::string() : pipeline_.health().waits_for;
    if (!step.has_image) return;
    run.frame_ms.push_back(ms);
    run.cameras.assign(pipeline_.models().begin(), pipeline_.models().end());
    if (step.input.left) {
      const ImageQuality& quality = pipeline_.image_quality();
      run.mean_features += quality.tracked + quality.added;
    }
    if (loops_) loops_->add(step.input, pipeline_, vision.init_utime, clock, run);
    if (!is_new) return;
    add_estimate(vision.estimate, step, run);
    if (loops_) run.corrected.push_back(loops_->corrected(vision.estimate));
  }

 private:
  VisionPipeline pipeline_;
  std::optional<Eigen::Vector3d> expected_v_B_;
  std::optional<Loops> loops_;
};

class PrimitiveRun {
 public:
  PrimitiveRun(const RunOptions& options, const std::optional<TrueState>& truth)
      : primitive_(truth, options.speed.value_or(kUsualSpeed)) {}

  void step(const FeedStep& step, Clock& clock, DatasetRun& run) {
    const Utime before = clock.now();
    const StateEstimate& estimate = primitive_.step(step.input);
    if (!step.has_image) return;
    run.frame_ms.push_back(1e3 * to_seconds(clock.now() - before));
    if (estimate.valid) add_estimate(estimate, step, run);
  }

 private:
  RecordedPrimitive primitive_;
};

// The images of one camera that could not be read.
struct Unreadable {
  int images = 0;
  std::string first;  // the reason for the first one, with its path

  void add(const std::string& error) {
    if (!error.empty() && images++ == 0) first = error;
  }
  void warn(const SampleOrigin& origin, const char* consequence, Diagnostics& diagnostics) const {
    diagnostics.add(origin.of_all(
        Severity::kWarning, "IMAGE",
        fmt::format("{} image(s) cannot be read, {}; the first: {}", images, consequence, first),
        ""));
  }
};

void note_left_out(const SampleOrigin& origin, std::size_t images, Diagnostics& diagnostics) {
  if (images == 0) return;
  diagnostics.add(origin.of_all(
      Severity::kNote, "LEFT-OUT",
      fmt::format("{} image(s) before the start of the estimate are left out", images), ""));
}

// Feeds the recording to an estimator.
template <typename Estimator>
tl::expected<DatasetRun, std::string> run_with(Estimator& estimator, RecordingFeed& feed,
                                               const Recording& recording, Clock& clock,
                                               const std::function<void(double)>& progress) {
  DatasetRun run;
  const RecordedCamera& camera = recording.cameras[0];
  const std::size_t first = feed.first_image();
  const std::size_t frames = camera.images.size() - first;
  if (frames == 0) return Failure("there is no image after the time at which to start");
  run.begin = camera.images[first].utime;
  run.frames = static_cast<int>(frames);
  note_left_out(camera.images_origin, first, run.diagnostics);
  Unreadable left;
  Unreadable right;
  while (auto step = feed.next()) {
    const std::size_t done = step->image - first + (step->has_image ? 1 : 0);
    left.add(step->left_error);
    right.add(step->right_error);
    estimator.step(std::move(*step), clock, run);
    progress(static_cast<double>(done) / static_cast<double>(frames));
  }
  if (left.images == run.frames) return Failure("no image can be read; the first: " + left.first);
  if (left.images > 0) left.warn(camera.images_origin, "and are left out", run.diagnostics);
  if (right.images > 0) {
    right.warn(recording.cameras[1].images_origin, "and the left ones are used alone",
               run.diagnostics);
  }
  run.mean_features /= run.frames;
  return run;
}

// The start of a run.
struct Begin {
  Utime utime = 0;
  std::optional<TrueState> truth;        // at that time
  std::optional<TrueState> first_truth;  // there may be a later one only
};

Begin begin_of(const Recording& recording, RunStart start) {
  constexpr Utime kSameTime = 50'000;  // us
  Begin begin;
  begin.utime = std::max(recording.cameras.at(0).images.front().utime, recording.imu.front().utime);
  begin.first_truth = true_state(recording, begin.utime);
  if (!begin.first_truth) return begin;
  if (start == RunStart::kTruth) begin.utime = begin.first_truth->utime;
  if (begin.first_truth->utime <= begin.utime + kSameTime) begin.truth = begin.first_truth;
  return begin;
}

// What the depth reads more than the truth says at the start, m: depth counts from the
// surface, the heights of a motion capture from its floor. 0 where they agree, or cannot be
// compared.
double depth_datum(const Recording& recording, const std::optional<TrueState>& truth) {
  constexpr double kApart_s = 0.5;
  constexpr double kSigmas = 5.0;
  if (!truth || recording.depth.empty()) return 0.0;
  const auto nearest = std::ranges::min_element(recording.depth, {}, [&](const DepthSample& at) {
    return std::abs(at.utime - truth->utime);
  });
  if (to_seconds(std::abs(nearest->utime - truth->utime)) > kApart_s) return 0.0;
  const double z = truth->X_WB.p.z() + (truth->X_WB.q * recording.depth_sensor_B).z();
  const double datum_m = nearest->depth_m + z;
  return std::abs(datum_m) > kSigmas * recording.depth_sigma_m ? datum_m : 0.0;
}

void note_datum(double datum_m, const Recording& recording,
                tl::expected<DatasetRun, std::string>& run) {
  if (!run || datum_m == 0.0) return;
  run->diagnostics.add(recording.depth_origin.of_all(
      Severity::kNote, "DEPTH-DATUM",
      fmt::format("depth reads {:.2f} m more than the truth's heights: it is counted from these",
                  datum_m),
      ""));
}

}  // namespace

VisualInertialOptions filter_options(const Recording& dataset, std::size_t cameras) {
  VisualInertialOptions options;
  for (std::size_t i = 0; i < std::min(cameras, dataset.cameras.size()); ++i) {
    options.cameras.push_back(dataset.cameras[i].model);
  }
  const RecordedCamera& left = dataset.cameras.front();
  options.focal_sigma = left.focal_sigma.value_or(kFocalSigma);
  options.centre_sigma_px = left.centre_sigma_px.value_or(kCentreSigma);
  options.refractive_index_sigma =
      left.refractive_index_sigma.value_or(options.refractive_index_sigma);
  const RecordedImuNoise& noise = dataset.imu_noise;
  options.depth_sigma_m = dataset.depth_sigma_m;
  options.depth_sensor_B = dataset.depth_sensor_B;
  options.imu.gyro = noise.gyro.value_or(options.imu.gyro);
  options.imu.accel = noise.accel.value_or(options.imu.accel);
  options.imu.gyro_walk = noise.gyro_walk.value_or(options.imu.gyro_walk);
  options.imu.accel_walk = noise.accel_walk.value_or(options.imu.accel_walk);
  options.imu_scale_sigma = noise.scale.value_or(options.imu_scale_sigma);
  options.imu.gyro_by_accel = noise.gyro_by_accel.value_or(kMemsGyroByAccel);
  options.gyro_limit = noise.gyro_range;
  options.accel_limit = noise.accel_range;
  options.gyro_bias_sigma = noise.gyro_bias.value_or(options.gyro_bias_sigma);
  options.accel_bias_sigma = noise.accel_bias.value_or(options.accel_bias_sigma);
  return options;
}

Trajectory true_trajectory(const Recording& dataset) {
  Trajectory trajectory;
  for (const TruePose& pose : dataset.truth) trajectory.push_back({pose.utime, pose.X_WB});
  return trajectory;
}

std::string RunOptions::validate() const {
  if (speed && !(std::abs(*speed) <= 3.0)) {
    return fmt::format("a speed of {} m/s; at most 3", *speed);
  }
  return {};
}

tl::expected<DatasetRun, std::string> run_on(const Recording& recording, const RunOptions& options,
                                             Clock& clock,
                                             const std::function<void(double)>& progress) {
  if (const std::string why = options.validate(); !why.empty()) return Failure(why);
  const bool is_visual = options.estimator == EstimatorKind::kVisualInertial;
  if (options.loops && (options.mono || recording.cameras.size() < 2 || !is_visual)) {
    return Failure("loops are closed by the visual-inertial estimator with two cameras only");
  }
  const Begin begin = begin_of(recording, options.start);
  const double datum_m = options.use_depth ? depth_datum(recording, begin.truth) : 0.0;
  RecordingFeed feed(recording, {.begin = begin.utime,
                                 .use_depth = options.use_depth,
                                 .depth_datum_m = datum_m,
                                 .read_images = is_visual,
                                 .mono = options.mono});
  const auto compared = [&](tl::expected<DatasetRun, std::string> run) {
    if (run && begin.first_truth && !begin.truth) move_to(*begin.first_truth, *run);
    note_datum(datum_m, recording, run);
    return run;
  };
  if (!is_visual) {
    PrimitiveRun primitive(options, begin.truth);
    return compared(run_with(primitive, feed, recording, clock, progress));
  }
  const auto start = vision_start(recording, options, begin.truth, begin.utime);
  if (!start) return Failure(start.error());
  VisionOptions vision;
  vision.filter = filter_options(recording, options.mono ? 1 : 2);
  // The limit of divergence is for our vehicle; drones and hands are faster.
  vision.filter.max_speed = kMaxRecordedSpeed;
  if (recording.depth.empty() || !options.use_depth) vision.filter.depth_bias_sigma_m = 0.0;
  vision.period_s = feed.period_s();
  if (std::string problem = vision.validate(); !problem.empty()) return Failure(problem);
  VisualRun visual(recording, options, vision, *start);
  return compared(run_with(visual, feed, recording, clock, progress));
}

}  // namespace dive::estimation
