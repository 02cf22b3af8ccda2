#include "estimation/visual_inertial/pipeline/vision_pipeline.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/visual_inertial/front_end/gyro_turn.h"

namespace dive::estimation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kMinProbation = 4.0;      // s of proof required after a divergence
constexpr double kMaxProbation = 30.0;     // s, maximum of that after repeated ones
constexpr double kForgiven = 60.0;         // s after which a divergence is forgotten
constexpr Utime kRecent = 2'000'000;       // us of IMU samples
constexpr Utime kAhead = 100'000;          // us
constexpr Utime kLongGap = 1'000'000;      // us without IMU, after which it is re-initialised
constexpr double kMinSigma = 0.01;         // m
constexpr double kMinYawSigma = 0.1;       // deg
constexpr double kTiltSigma = 0.5;         // deg
constexpr double kSpeedSigma = 0.05;       // m/s
constexpr double kSharpnessMemory = 0.02;  // weight of the newest image
constexpr Utime kInTheDark = 300'000;      // us without a usable image
constexpr double kBiasPeriod_s = 5.0;      // between two biases that are remembered
constexpr double kBiasSafety = 2.0;        // of their sigmas when it begins with them again

std::optional<CameraModel> second_of(const std::vector<CameraModel>& cameras) {
  return cameras.size() > 1 ? std::optional(cameras[1]) : std::nullopt;
}

KnownStart start_from(const StateEstimate& published) {
  KnownStart start;
  start.utime = published.utime;
  start.X_WB = published.X_WB;
  start.v_WB_B = published.v_WB_B;
  start.position_sigma_m = std::max(horizontal_sigma(published), kMinSigma);
  const Vector3d up_B = published.X_WB.q.conjugate() * Vector3d::UnitZ();
  const double yaw_variance = up_B.dot(published.covariance.bottomRightCorner<3, 3>() * up_B);
  start.yaw_sigma_deg = std::max(rad_to_deg(std::sqrt(std::max(yaw_variance, 0.0))), kMinYawSigma);
  start.tilt_sigma_deg = kTiltSigma;
  start.speed_sigma = kSpeedSigma;
  return start;
}

VisionFault of_image(ImageFault fault) {
  switch (fault) {
    case ImageFault::kNone:
      return VisionFault::kNone;
    case ImageFault::kFrozen:
      return VisionFault::kFrozen;
    case ImageFault::kNoContrast:
      return VisionFault::kDark;
    case ImageFault::kFewFeatures:
      return VisionFault::kFewFeatures;
    case ImageFault::kLost:
      return VisionFault::kLost;
    case ImageFault::kNotAsAgreed:
    case ImageFault::kNotLater:
    case ImageFault::kLibraryError:
      return VisionFault::kBadImage;
  }
  return VisionFault::kBadImage;
}

}  // namespace

std::string VisionOptions::validate() const {
  RangeCheck check;
  check("period_s", period_s, 0.005, 2.0);
  check("blurred_share", blurred_share, 0.0, 1.0);
  check("grace_s", grace_s, 0.0, 10.0);
  check("refused_s", refused_s, 0.1, 10.0);
  check("max_refused_s", max_refused_s, 0.1, 1000.0);
  check("max_dark_s", max_dark_s, 0.1, 1000.0);
  check("expected_sigma", expected_sigma, 1e-3, 10.0);
  check("expected_hz", expected_hz, 0.1, 100.0);
  check("tag_period_s", tag_period_s, 0.01, 10.0);
  if (!check.problem().empty()) return check.problem();
  if (std::string problem = tag_fix.validate(); !problem.empty()) return problem;
  if (filter.cameras.empty()) return "there is no camera";
  if (std::string problem = filter.validate(); !problem.empty()) return problem;
  return tracker.validate();
}

VisionPipeline::VisionPipeline(const VisionOptions& options, std::uint64_t seed)
    : options_((DIVE_DEMAND(options.validate().empty()), options)),
      filter_(options_.filter, KnownStart{}),
      tracker_(options_.tracker, options_.filter.cameras[0], second_of(options_.filter.cameras),
               seed),
      tag_fix_(options_.tags, options_.filter.cameras[0], options_.tag_fix),
      last_tag_detection_(-from_seconds(options_.tag_period_s)) {
  if (options_.tags.empty()) return;
  tag_detector_.emplace(options_.filter.cameras[0], options_.tag_detector);
}

// Called while the filter is healthy.
void VisionPipeline::remember_bias() {
  if (recent_bias_ && to_seconds(newest_ - recent_bias_->utime) < kBiasPeriod_s) return;
  proven_bias_ = recent_bias_;
  const ImuState& imu = filter_.state().imu;
  const auto sigmas =
      filter_.state().covariance().diagonal().segment<6>(imu_error::kGyroBias).cwiseSqrt();
  recent_bias_ = KnownBias{
      newest_,
      {imu.gyro_bias, imu.accel_bias, sigmas.head<3>().maxCoeff(), sigmas.tail<3>().maxCoeff()}};
}

void VisionPipeline::begin(const StateEstimate& published) {
  KnownStart start = start_from(published);
  if (proven_bias_) {
    start.bias = proven_bias_->prior;
    const double seconds = std::max(to_seconds(published.utime - proven_bias_->utime), 0.0);
    const auto grown = [seconds](double sigma, double walk, double most) {
      return std::min(kBiasSafety * std::sqrt(sigma * sigma + walk * walk * seconds), most);
    };
    const VisualInertialOptions& filter = options_.filter;
    start.bias.gyro_sigma =
        grown(*start.bias.gyro_sigma, filter.imu.gyro_walk, filter.gyro_bias_sigma);
    start.bias.accel_sigma =
        grown(*start.bias.accel_sigma, filter.imu.accel_walk, filter.accel_bias_sigma);
  }
  recent_bias_.reset();
  filter_.restart(start);
  tag_fix_.restart();
  init_utime_ = published.utime;
  began_at_ = newest_;
  has_begun_ = true;
  has_gap_ = false;
  usable_since_ = last_image_ = newest_;
}

void VisionPipeline::add(const VisionInput& input) {
  for (const ImuSample& sample : input.imu) {
    if (sample.utime > input.published.utime + kAhead) continue;  // an invalid clock
    filter_.add(sample);
    if (!sample.gyro_B.allFinite() || sample.utime <= newest_) continue;
    has_gap_ |= sample.utime - newest_ > kLongGap;
    newest_ = sample.utime;
    recent_.push_back(sample);
  }
  std::erase_if(recent_, [&](const ImuSample& s) { return s.utime < newest_ - kRecent; });
  for (const DepthSample& sample : input.depth) filter_.add(sample);
}

// Adds the expected speed while there are no usable images.
void VisionPipeline::expect_speed(const StateEstimate& published) {
  const bool is_dark = newest_ - last_image_ > kInTheDark;
  const bool is_due =
      to_seconds(published.utime - last_speed_update_) >= 1.0 / options_.expected_hz;
  if (!is_dark || !is_due || !published.valid || !published.v_WB_B.allFinite()) return;
  last_speed_update_ = published.utime;
  filter_.add_speed(published.utime, published.v_WB_B, Vector3d::Constant(options_.expected_sigma));
}

// Turn of the left camera since the tracker's last image.
std::optional<CameraTurn> VisionPipeline::turn_to(Utime utime) const {
  const std::optional<Utime> from = tracker_.utime();
  if (!from || *from >= utime || recent_.empty() || recent_.front().utime > *from) {
    return std::nullopt;
  }
  return turn_by_gyro(recent_, *from, utime, filter_.gyro_bias(),
                      options_.filter.cameras[0].X_BC.q);
}

ImageQuality VisionPipeline::track(const VisionInput& input) {
  const ImageFrame* right = input.right ? &*input.right : nullptr;
  TrackedImage tracked = tracker_.step(*input.left, right, turn_to(input.left->utime));
  if (!tracked.frame.features.empty()) filter_.add(std::move(tracked.frame));
  return std::move(tracked.quality);
}

VisionFault VisionPipeline::check_image(const ImageQuality& quality) {
  const VisionFault fault = of_image(quality.fault);
  const bool has_features = fault == VisionFault::kNone || fault == VisionFault::kFewFeatures ||
                            fault == VisionFault::kLost;
  const bool is_blurred = quality.sharpness < options_.blurred_share * sharpness_;
  if (has_features && is_blurred) return VisionFault::kBlurred;
  if (fault != VisionFault::kNone) return fault;
  sharpness_ = sharpness_ == 0.0 ? quality.sharpness
                                 : sharpness_ + kSharpnessMemory * (quality.sharpness - sharpness_);
  return VisionFault::kNone;
}

VisionFault VisionPipeline::check_filter(Utime now) {
  const FilterHealth& health = filter_.health();
  if (health.diverged) return VisionFault::kDiverged;
  // The cause of a divergence may persist, and a new filter takes it for its biases.
  const double seen_s = to_seconds(now - began_at_);
  if (seen_s < proof_s_) return VisionFault::kRefused;
  if (seen_s > kForgiven) proof_s_ = 0.0;
  const bool sees_for_a_while = to_seconds(now - usable_since_) > options_.grace_s;
  const bool is_refused = health.is_suspect || health.since_visual_s > options_.refused_s;
  return sees_for_a_while && is_refused ? VisionFault::kRefused : VisionFault::kNone;
}

// The filter's estimate is some hundredths of a second after the image.
void VisionPipeline::detect_tags(const ImageFrame& image, VisionEstimate& estimate) {
  const double since_s = to_seconds(image.utime - last_tag_detection_);
  if (!tag_detector_ || since_s < options_.tag_period_s) return;
  last_tag_detection_ = image.utime;
  const std::vector<DetectedTag> detected = tag_detector_->find(image);
  if (detected.empty()) return;
  StateEstimate then = estimate.estimate;
  const double dt = to_seconds(image.utime - then.utime);
  then.utime = image.utime;
  then.X_WB.p += dt * (then.X_WB.q * then.v_WB_B);
  then.X_WB.q = (then.X_WB.q * so3_exp(dt * then.omega_WB_B)).normalized();
  estimate.tag = tag_fix_.add(then, detected);
}

VisionEstimate VisionPipeline::step(const VisionInput& input) {
  add(input);
  imaged_.reset();
  const std::int64_t frames = filter_.state_frames();
  const Utime dark = newest_ - last_image_;
  // A filter that has used none of so many features is not going to use one.
  const bool uses_none =
      dark < kInTheDark && std::min(to_seconds(newest_ - usable_since_),
                                    filter_.health().since_visual_s) > options_.max_refused_s;
  const bool has_failed = filter_.health().diverged || uses_none;
  const bool is_lost =
      has_failed || has_gap_ || (input.left && to_seconds(dark) > options_.max_dark_s);
  if (input.published.valid && (!has_begun_ || is_lost)) {
    if (has_failed) proof_s_ = std::clamp(2.0 * proof_s_, kMinProbation, kMaxProbation);
    begin(input.published);
  }
  VisionEstimate estimate;
  estimate.frame_utime = input.left ? input.left->utime : newest_;
  estimate.period_s = options_.period_s;
  estimate.fault = VisionFault::kNoImages;
  if (input.left) {
    const ImageQuality quality = track(input);
    estimate.tracked = quality.tracked;
    estimate.stereo = quality.stereo;
    estimate.fault = check_image(quality);
  }
  expect_speed(input.published);
  estimate.estimate = filter_.update(newest_);
  estimate.init_utime = init_utime_;
  estimate.used = filter_.health().visual.used;
  const bool is_usable =
      estimate.fault == VisionFault::kNone || estimate.fault == VisionFault::kFewFeatures;
  // After a period of darkness the filter is still correcting its errors.
  const bool is_settled =
      newest_ - last_image_ <= kInTheDark && to_seconds(newest_ - usable_since_) > options_.grace_s;
  if (is_usable && is_settled && estimate.estimate.valid && !filter_.health().diverged) {
    detect_tags(*input.left, estimate);
  }
  estimate.estimate = tag_fix_.apply(estimate.estimate);
  if (estimate.fault != VisionFault::kNone) {
    if (filter_.health().diverged) estimate.fault = VisionFault::kDiverged;
    return estimate;
  }
  if (newest_ - last_image_ > kInTheDark) usable_since_ = newest_;
  last_image_ = newest_;
  estimate.fault = check_filter(newest_);
  if (estimate.fault == VisionFault::kNone) remember_bias();
  const Utime taken = input.left->utime + from_seconds(filter_.state().time_offset_s);
  const bool has_it = filter_.state_frames() > frames && taken <= newest_;
  if (estimate.is_good() && has_it) imaged_ = input.left->utime;
  return estimate;
}

std::optional<StateEstimate> VisionPipeline::at_image() const {
  const FilterState& state = filter_.state();
  if (!imaged_ || state.clones().empty()) return std::nullopt;
  StateEstimate estimate;
  estimate.utime = *imaged_;
  estimate.valid = true;
  estimate.source = EstimatorKind::kVisualInertial;
  estimate.X_WB = state.clones().back().X_WB;
  const int start = state.clone_columns(state.clones().size() - 1).start;
  // The window's order is (theta, p).
  const Matrix6d P = state.covariance().block<6, 6>(start, start);
  estimate.covariance << P.bottomRightCorner<3, 3>(), P.bottomLeftCorner<3, 3>(),
      P.topRightCorner<3, 3>(), P.topLeftCorner<3, 3>();
  return estimate;
}

}  // namespace dive::estimation
