#include "estimation/dataset/dataset_run.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "estimation/primitive.h"
#include "estimation/visual_inertial/filter/visual_inertial_filter.h"
#include "estimation/visual_inertial/front_end/gyro_turn.h"
#include "estimation/visual_inertial/front_end/tracker.h"
#include "estimation/visual_inertial/loop_closure/loop_closer.h"

namespace dive::estimation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kGravityRate = 0.05;      // 1/s, gain towards gravity of the integrated attitude
constexpr double kTruthGap = 0.2;          // s
constexpr double kStartSigma = 0.01;       // m, of a position from the truth
constexpr double kUnknownSigma = 0.1;      // m, of an assumed position
constexpr double kLongStep = 0.1;          // s between two IMU samples
constexpr double kUsualSpeed = 0.4;        // m/s, of the primitive estimator
constexpr double kSpeedSigma = 0.1;        // m/s, of a speed that is given
constexpr double kGyroBiasSigma = 0.005;   // rad/s, of a bias from the truth
constexpr double kMemsGyroByAccel = 3e-5;  // rad/s per m/s^2: 0.015 deg/s/g
constexpr double kAccelBiasSigma = 0.05;   // m/s^2
// A housing calibrated in another water, at another temperature and depth, is off by so much.
constexpr double kFocalSigma = 0.005;
constexpr double kCentreSigma = 2.0;  // pixels
// A motion capture's frame is level, and its markers are aligned with the IMU, to about a degree.
constexpr double kTrueAttitudeSigmaDeg = 1.0;

using Failure = tl::unexpected<std::string>;

// Attitude as from an AHRS, which the format does not record: the gyro integrated, and slowly
// corrected towards gravity (Mahony et al. 2008, proportional part).
class PredictedAttitude {
 public:
  explicit PredictedAttitude(std::optional<Quaterniond> start) : q_WB_(std::move(start)) {}

  void add_to(ImuSample& sample) {
    const Vector3d& up_B = sample.accel_B;
    if (!q_WB_) q_WB_ = Quaterniond::FromTwoVectors(up_B, Vector3d::UnitZ());
    if (last_) {
      const double dt = std::min(to_seconds(sample.utime - *last_), kLongStep);
      const Vector3d expected = q_WB_->conjugate() * Vector3d::UnitZ();
      const Vector3d pull = up_B.normalized().cross(expected);
      q_WB_ = (*q_WB_ * so3_exp(dt * (sample.gyro_B + kGravityRate * pull))).normalized();
    }
    last_ = sample.utime;
    sample.q_WB = *q_WB_;
  }

 private:
  std::optional<Quaterniond> q_WB_;
  std::optional<Utime> last_;
};

// Initial data of a run.
struct Beginning {
  Utime utime = 0;
  Pose X_WB;
  bool has_attitude = false;
  std::optional<Vector3d> v_WB_B;
  std::optional<BiasPrior> bias;
};

std::optional<Beginning> true_beginning(const Recording& dataset, Utime utime) {
  const Trajectory truth = true_trajectory(dataset);
  // The truth may begin later than the images.
  const auto first = std::find_if(truth.begin(), truth.end(),
                                  [&](const StampedPose& at) { return at.utime >= utime; });
  if (first == truth.end()) return std::nullopt;
  Beginning beginning;
  beginning.utime = first->utime;
  beginning.X_WB = first->X_WB;
  beginning.has_attitude = dataset.has_true_attitude;
  const TruePose& pose = dataset.truth[static_cast<std::size_t>(first - truth.begin())];
  const auto next = pose_at(truth, first->utime + 50'000, kTruthGap);
  if (pose.bias) {
    beginning.bias = BiasPrior{pose.bias->gyro, pose.bias->accel, kGyroBiasSigma, kAccelBiasSigma};
  }
  const Quaterniond q_BW = first->X_WB.q.conjugate();
  if (pose.v_W) {
    beginning.v_WB_B = q_BW * *pose.v_W;
  } else if (next) {
    beginning.v_WB_B = q_BW * (next->p - first->X_WB.p) / 0.05;
  }
  return beginning;
}

tl::expected<FilterStart, std::string> start_of(const RunOptions& options,
                                                const std::optional<Beginning>& truth) {
  const double sigma = truth ? kStartSigma : kUnknownSigma;
  const Vector3d position = truth ? truth->X_WB.p : Vector3d::Zero().eval();
  if (options.start == RunStart::kTruth) {
    if (!truth || !truth->has_attitude || !truth->v_WB_B) {
      return Failure("the recording has no true poses with attitude to start from");
    }
    KnownStart start;
    start.utime = truth->utime;
    start.X_WB = truth->X_WB;
    start.v_WB_B = *truth->v_WB_B;
    start.tilt_sigma_deg = start.yaw_sigma_deg = kTrueAttitudeSigmaDeg;
    if (truth->bias) start.bias = *truth->bias;
    return start;
  }
  ImageStart start;
  start.position_W = position;
  start.position_sigma_m = sigma;
  if (truth && truth->has_attitude) start.heading = truth->X_WB.q;
  if (options.speed) start.speed = ImageStart::Speed{{*options.speed, 0.0, 0.0}, kSpeedSigma};
  return start;
}

// Either estimator behind the calls for a recording.
class Runner {
 public:
  Runner(const Recording& dataset, const RunOptions& options, const FilterStart& start,
         const std::optional<Beginning>& truth)
      : dataset_(dataset), options_(options) {
    if (options.estimator == EstimatorKind::kPrimitive) {
      primitive_.emplace(PrimitiveOptions{}, truth ? truth->X_WB.p : Vector3d::Zero().eval(),
                         truth ? kStartSigma : kUnknownSigma);
      primitive_->set_commanded_speed(options.speed.value_or(kUsualSpeed));
      return;
    }
    const VisualInertialOptions of_filter = filter_options(dataset, options.mono ? 1 : 2);
    const bool stereo = of_filter.cameras.size() > 1;
    problem_ = of_filter.validate();
    if (!problem_.empty()) return;
    filter_.emplace(of_filter, start);
    tracker_.emplace(TrackerOptions{}, of_filter.cameras[0],
                     stereo ? std::optional(of_filter.cameras[1]) : std::nullopt, options.seed);
  }

  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] bool needs_images() const { return tracker_.has_value(); }

  void add(const ImuSample& sample) {
    if (filter_) filter_->add(sample);
    if (primitive_) primitive_->add(sample);
  }

  void add(const DepthSample& sample) {
    if (filter_) filter_->add(sample);
    if (primitive_) primitive_->add(sample);
  }

  // Adds an image; the primitive estimator uses only its time.
  [[nodiscard]] ImageQuality add(const ImageFrame& left, const ImageFrame* right) {
    std::optional<CameraTurn> turn;
    if (const auto last = tracker_->utime(); last && *last < left.utime) {
      turn = turn_by_gyro(dataset_.imu, *last, left.utime, filter_->gyro_bias(),
                          dataset_.cameras[0].model.X_BC.q);
    }
    TrackedImage tracked = tracker_->step(left, right, turn);
    if (!tracked.frame.features.empty()) filter_->add(std::move(tracked.frame));
    return std::move(tracked.quality);
  }

  [[nodiscard]] const StateEstimate& update(Utime now) {
    return filter_ ? filter_->update(now) : primitive_->update(now);
  }

  /// Camera poses as calibrated by the filter.
  [[nodiscard]] const std::vector<Pose>& cameras_B() const { return filter_->state().cameras_B; }

  [[nodiscard]] std::string waits_for() const {
    return filter_ ? filter_->health().waits_for : std::string();
  }

  [[nodiscard]] std::string diverged() const {
    return filter_ && filter_->health().diverged ? filter_->health().reason : std::string();
  }

 private:
  const Recording& dataset_;
  RunOptions options_;
  std::optional<PrimitiveEstimator> primitive_;
  std::optional<VisualInertialFilter> filter_;
  std::optional<Tracker> tracker_;
  std::string problem_;
};

// Loop closure on a recording: each keyframe is processed before the next image.
class Loops {
 public:
  Loops(const Recording& dataset, bool has_depth)
      : viewer_({}, dataset.cameras[0].model, dataset.cameras[1].model),
        closer_(options_of(has_depth), dataset.cameras[0].model, dataset.cameras[1].model) {}

  void add(const ImageFrame& left, const ImageFrame& right, const StateEstimate& filter,
           const std::vector<Pose>& cameras_B, Clock& clock, DatasetRun& run) {
    if (!closer_.is_due(filter)) return;
    const Utime before = clock.now();
    closer_.calibrate(cameras_B[0], cameras_B[1]);
    if (auto view = viewer_.view(left, right)) {
      if (auto correction = closer_.add(std::move(*view), filter)) {
        correction_ = std::move(*correction);
        run.closures.push_back(correction_->closure);
      }
      ++run.keyframes;
    }
    run.loop_ms.push_back(1e3 * to_seconds(clock.now() - before));
  }

  [[nodiscard]] StateEstimate corrected(const StateEstimate& filter) const {
    return correction_ ? correction_->apply(filter) : filter;
  }

 private:
  static LoopCloserOptions options_of(bool has_depth) {
    LoopCloserOptions options;
    options.has_depth = has_depth;
    return options;
  }

  KeyframeExtractor viewer_;
  LoopCloser closer_;
  std::optional<LoopCorrection> correction_;
};

// The images of one exposure, as far as the runner needs them.
struct Exposure {
  std::optional<ImageFrame> left;
  std::optional<ImageFrame> right;
};

tl::expected<Exposure, std::string> read_exposure(const Recording& dataset,
                                                  const RecordedImage& image, bool mono) {
  Exposure exposure;
  auto left = read_image(image, 0);
  if (!left) return Failure(left.error());
  exposure.left = std::move(*left);
  const RecordedImage* other = mono || dataset.cameras.size() < 2
                                   ? nullptr
                                   : image_at(dataset.cameras[1].images, image.utime);
  if (other == nullptr) return exposure;
  auto right = read_image(*other, 1);
  if (!right) return Failure(right.error());
  exposure.right = std::move(*right);
  return exposure;
}

// Feeds IMU and depth samples to a runner, in order of time.
class SampleFeed {
 public:
  /// `begin`: time of the initial attitude `q_WB`; earlier IMU samples are left out.
  SampleFeed(const Recording& dataset, bool use_depth, Utime begin, std::optional<Quaterniond> q_WB)
      : dataset_(dataset),
        use_depth_(use_depth),
        begin_(begin),
        attitude_(std::move(q_WB)),
        imu_(dataset.imu.begin()),
        depth_(dataset.depth.begin()) {}

  /// Up to and including the first IMU sample after an image.
  void feed_image(Utime utime, Runner& runner) {
    feed(utime, runner);
    if (imu_ != dataset_.imu.end()) feed(imu_->utime, runner);
  }

 private:
  void feed(Utime until, Runner& runner) {
    while (imu_ != dataset_.imu.end() && imu_->utime <= until) {
      for (; use_depth_ && depth_ != dataset_.depth.end() && depth_->utime <= imu_->utime;
           ++depth_) {
        runner.add(*depth_);
      }
      ImuSample sample = *imu_++;
      if (sample.utime < begin_) continue;
      attitude_.add_to(sample);
      runner.add(sample);
    }
  }

  const Recording& dataset_;
  bool use_depth_;
  Utime begin_;
  PredictedAttitude attitude_;
  std::vector<ImuSample>::const_iterator imu_;
  std::vector<DepthSample>::const_iterator depth_;
};

void take_note(const ImageQuality& quality, DatasetRun& run) {
  run.mean_features += quality.tracked + quality.added;
  if (quality.fault == ImageFault::kNone) return;
  run.last_fault = quality.reason;
  ++(quality.fault == ImageFault::kLost          ? run.lost
     : quality.fault == ImageFault::kFewFeatures ? run.poor
                                                 : run.refused);
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
  options.imu.gyro = noise.gyro.value_or(options.imu.gyro);
  options.imu.accel = noise.accel.value_or(options.imu.accel);
  options.imu.gyro_walk = noise.gyro_walk.value_or(options.imu.gyro_walk);
  options.imu.accel_walk = noise.accel_walk.value_or(options.imu.accel_walk);
  options.imu_scale_sigma = noise.scale.value_or(options.imu_scale_sigma);
  options.imu.gyro_by_accel = noise.gyro_by_accel.value_or(kMemsGyroByAccel);
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

tl::expected<DatasetRun, std::string> run_on(const Recording& dataset, const RunOptions& options,
                                             Clock& clock,
                                             const std::function<void(double)>& progress) {
  if (const std::string why = options.validate(); !why.empty()) return Failure(why);
  const std::vector<RecordedImage>& images = dataset.cameras.at(0).images;
  Utime begin = std::max(images.front().utime, dataset.imu.front().utime);
  const std::optional<Beginning> truth = true_beginning(dataset, begin);
  if (truth) begin = truth->utime;
  const auto start = start_of(options, truth);
  if (!start) return Failure(start.error());
  Runner runner(dataset, options, *start, truth);
  if (!runner.problem().empty()) return Failure(runner.problem());
  std::optional<Loops> loops;
  if (options.loops) {
    if (options.mono || dataset.cameras.size() < 2 || !runner.needs_images()) {
      return Failure("loops are closed by the visual-inertial estimator with two cameras only");
    }
    loops.emplace(dataset, options.use_depth && !dataset.depth.empty());
  }

  DatasetRun run;
  std::optional<Quaterniond> q_WB;
  if (truth && truth->has_attitude) q_WB = truth->X_WB.q;
  SampleFeed samples(dataset, options.use_depth, begin, q_WB);
  for (const RecordedImage& image : images) {
    ++run.frames;
    if (image.utime < begin) continue;
    samples.feed_image(image.utime, runner);
    Exposure exposure;
    if (runner.needs_images()) {
      auto read = read_exposure(dataset, image, options.mono);
      if (!read) return Failure(read.error());
      exposure = std::move(*read);
    }
    const auto& [left, right] = exposure;
    const Utime before = clock.now();
    if (left) take_note(runner.add(*left, right ? &*right : nullptr), run);
    const StateEstimate& estimate = runner.update(image.utime);
    run.frame_ms.push_back(1e3 * to_seconds(clock.now() - before));
    if (estimate.valid && run.estimates.empty()) run.began_s = to_seconds(image.utime - begin);
    if (estimate.valid) run.estimates.push_back(estimate);
    if (loops && left && right) loops->add(*left, *right, estimate, runner.cameras_B(), clock, run);
    if (loops && estimate.valid) run.corrected.push_back(loops->corrected(estimate));
    progress(static_cast<double>(run.frames) / static_cast<double>(images.size()));
  }
  if (run.frames > 0) run.mean_features /= run.frames;
  run.diverged = runner.diverged();
  run.waits_for = run.estimates.empty() ? runner.waits_for() : std::string();
  return run;
}

}  // namespace dive::estimation
