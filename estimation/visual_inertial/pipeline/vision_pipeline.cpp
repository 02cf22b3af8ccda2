#include "estimation/visual_inertial/pipeline/vision_pipeline.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/visual_inertial/front_end/gyro_turn.h"
#include "estimation/visual_inertial/front_end/stereo.h"

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
constexpr double kTiltSigma = 0.5;         // deg
constexpr double kSpeedSigma = 0.05;       // m/s
constexpr double kSharpnessMemory = 0.02;  // weight of the newest image
constexpr double kBlurredMemory = 0.005;   // of one that seems blurred: the scene may be smoother
constexpr Utime kInTheDark = 300'000;      // us without a usable image
constexpr double kVelocityAge_s = 0.5;     // of a measured velocity that a start uses

std::optional<CameraModel> second_of(const std::vector<CameraModel>& cameras) {
  return cameras.size() > 1 ? std::optional(cameras[1]) : std::nullopt;
}

KnownStart start_from(const StateEstimate& published) {
  KnownStart start;
  start.utime = published.utime;
  start.X_WB = published.X_WB;
  start.v_WB_B = published.v_WB_B;
  start.position_sigma_m = std::max(horizontal_sigma(published), kMinStartSigma_m);
  start.yaw_sigma_deg = std::max(rad_to_deg(yaw_sigma(published)), kMinStartYawSigma_deg);
  start.tilt_sigma_deg = kTiltSigma;
  start.speed_sigma = kSpeedSigma;
  return start;
}

// The filter's first start: that of a dive waits for a published estimate.
FilterStart first_start(const VisionStart& start) {
  if (const auto* const images = std::get_if<ImageStart>(&start)) return *images;
  if (const auto* const known = std::get_if<KnownStart>(&start)) return *known;
  return KnownStart{};
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

// What the front end cannot use.
std::string problem_of(const std::vector<CameraModel>& cameras) {
  for (const CameraModel& camera : cameras) {
    if (std::min(camera.width, camera.height) >= Tracker::kMinSide_px) continue;
    return fmt::format("a camera has images of {} x {} pixels; at least {} x {} are needed",
                       camera.width, camera.height, Tracker::kMinSide_px, Tracker::kMinSide_px);
  }
  if (cameras.size() < 2) return {};
  const CameraModel& left = cameras[0];
  const CameraModel& right = cameras[1];
  if (left.width != right.width || left.height != right.height) {
    return fmt::format("the images of the two cameras differ in size: {} x {} and {} x {} pixels",
                       left.width, left.height, right.width, right.height);
  }
  const double baseline_m = (left.X_BC.p - right.X_BC.p).norm();
  if (baseline_m > StereoMatcher::kMinBaseline_m) return {};
  return fmt::format("the two cameras are {:g} m apart; more than {:g} m are needed", baseline_m,
                     StereoMatcher::kMinBaseline_m);
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
  if (std::string problem = problem_of(filter.cameras); !problem.empty()) return problem;
  if (std::string problem = filter.validate(); !problem.empty()) return problem;
  return tracker.validate();
}

VisionPipeline::VisionPipeline(const VisionOptions& options, const VisionStart& start,
                               std::uint64_t seed)
    : options_((DIVE_DEMAND(options.validate().empty()), options)),
      is_published_(std::holds_alternative<PublishedStart>(start)),
      filter_(options_.filter, first_start(start)),
      tracker_(options_.tracker, options_.filter.cameras[0], second_of(options_.filter.cameras),
               seed),
      tag_fix_(options_.tags, options_.filter.cameras[0], options_.tag_fix),
      last_tag_detection_(-from_seconds(options_.tag_period_s)),
      memory_(options_.filter, start) {
  if (options_.tags.empty()) return;
  tag_detector_.emplace(options_.filter.cameras[0], options_.tag_detector);
}

bool VisionPipeline::can_begin(const VisionInput& input) const {
  return is_published_ ? input.published.valid : newest_ > 0;
}

std::optional<VisionRestart> VisionPipeline::reason_to_restart(bool has_image) const {
  const FilterHealth& health = filter_.health();
  if (health.diverged) {
    return VisionRestart{newest_, true, "the filter has diverged: " + health.reason};
  }
  // A filter that has used none of so many features is not going to use one.
  const Utime dark = newest_ - last_image_;
  const double unused_s = std::min(to_seconds(newest_ - usable_since_), health.since_visual_s);
  if (dark < kInTheDark && unused_s > options_.max_refused_s) {
    return VisionRestart{newest_, true,
                         fmt::format("the filter used no feature for {:.1f} s", unused_s)};
  }
  if (gap_s_ > 0.0) {
    return VisionRestart{newest_, false, fmt::format("no IMU samples for {:.1f} s", gap_s_)};
  }
  // A published estimate is better than the filter's in darkness; its own is the best else.
  const double dark_s = is_published_ ? (has_image ? to_seconds(dark) : 0.0) : dark_s_;
  if (dark_s <= options_.max_dark_s) return std::nullopt;
  return VisionRestart{newest_, false, fmt::format("no usable image for {:.1f} s", dark_s)};
}

// For a start from images: measured, else expected.
std::optional<ImageStart::Speed> VisionPipeline::known_speed(const VisionInput& input) const {
  if (velocity_ && std::abs(to_seconds(newest_ - velocity_->utime)) < kVelocityAge_s) {
    return ImageStart::Speed{velocity_->v_B, velocity_->sigma, velocity_->utime};
  }
  if (!input.expected_v_B || !input.expected_v_B->allFinite()) return std::nullopt;
  return ImageStart::Speed{*input.expected_v_B, options_.expected_sigma, std::nullopt};
}

void VisionPipeline::restart(const VisionInput& input) {
  if (is_published_) {
    KnownStart start = start_from(input.published);
    start.bias = memory_.bias_at(input.published.utime).value_or(BiasPrior{});
    filter_.restart(start);
  } else {
    ImageStart start = memory_.image_start();
    start.speed = known_speed(input);
    filter_.restart(start);
  }
  tag_fix_.restart();
}

void VisionPipeline::begin_if_needed(const VisionInput& input) {
  restarted_.reset();
  std::optional<VisionRestart> reason = reason_to_restart(input.left.has_value());
  if (!can_begin(input) || (has_begun_ && !reason)) return;
  const bool has_failed = reason && reason->has_failed;
  if (has_failed) proof_s_ = std::clamp(2.0 * proof_s_, kMinProbation, kMaxProbation);
  memory_.restart(has_failed);
  // A given start is the filter's from the beginning.
  if (is_published_ || has_begun_) restart(input);
  if (has_begun_) restarted_ = std::move(reason);
  init_utime_ = is_published_ ? input.published.utime : newest_;
  began_at_ = newest_;
  has_begun_ = true;
  gap_s_ = dark_s_ = 0.0;
  usable_since_ = last_image_ = newest_;
}

void VisionPipeline::add(const VisionInput& input) {
  for (const ImuSample& sample : input.imu) {
    if (sample.utime > input.now + kAhead) continue;  // an invalid clock
    filter_.add(sample);
    if (!sample.gyro_B.allFinite() || sample.utime <= newest_) continue;
    if (const Utime step = sample.utime - newest_; step > kLongGap) gap_s_ = to_seconds(step);
    newest_ = sample.utime;
    recent_.push_back(sample);
    memory_.add(sample);
  }
  std::erase_if(recent_, [&](const ImuSample& s) { return s.utime < newest_ - kRecent; });
  for (const DepthSample& sample : input.depth) filter_.add(sample);
  for (const VelocitySample& sample : input.velocity) {
    if (!sample.v_B.allFinite() || !(sample.sigma > 0.0)) continue;
    filter_.add_speed(sample.utime, sample.v_B, Vector3d::Constant(sample.sigma));
    velocity_ = sample;
  }
}

// Adds the expected speed while there are no usable images.
void VisionPipeline::expect_speed(const VisionInput& input) {
  const bool is_dark = newest_ - last_image_ > kInTheDark;
  const bool is_due = to_seconds(input.now - last_speed_update_) >= 1.0 / options_.expected_hz;
  if (!is_dark || !is_due || !input.expected_v_B || !input.expected_v_B->allFinite()) return;
  last_speed_update_ = input.now;
  filter_.add_speed(input.now, *input.expected_v_B, Vector3d::Constant(options_.expected_sigma));
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
  if (has_features && is_blurred) {
    sharpness_ += kBlurredMemory * (quality.sharpness - sharpness_);
    return VisionFault::kBlurred;
  }
  if (fault != VisionFault::kNone) return fault;
  // Noise in the dark is sharp: the first image to compare with is one with features of the last.
  if (sharpness_ > 0.0) {
    sharpness_ += kSharpnessMemory * (quality.sharpness - sharpness_);
  } else if (quality.tracked >= options_.tracker.min_features) {
    sharpness_ = quality.sharpness;
  }
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
  begin_if_needed(input);
  VisionEstimate estimate;
  estimate.frame_utime = input.left ? input.left->utime : newest_;
  estimate.period_s = options_.period_s;
  estimate.fault = VisionFault::kNoImages;
  if (input.left) {
    image_quality_ = track(input);
    image_fault_ = check_image(image_quality_);
    estimate.tracked = image_quality_.tracked;
    estimate.stereo = image_quality_.stereo;
    estimate.fault = image_fault_;
  }
  expect_speed(input);
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
  if (estimate.estimate.valid && !filter_.health().diverged) memory_.observe(estimate.estimate);
  if (estimate.fault != VisionFault::kNone) {
    if (filter_.health().diverged) estimate.fault = VisionFault::kDiverged;
    return estimate;
  }
  if (const Utime dark = newest_ - last_image_; dark > kInTheDark) {
    usable_since_ = newest_;
    if (estimate.estimate.valid) dark_s_ = to_seconds(dark);
  }
  last_image_ = newest_;
  estimate.fault = check_filter(newest_);
  if (estimate.is_good()) memory_.remember(newest_, filter_.state(), estimate.estimate);
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
