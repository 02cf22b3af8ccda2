#include "estimation/visual_inertial/filter/visual_inertial_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "estimation/visual_inertial/filter/image_motion.h"
#include "estimation/visual_inertial/filter/rolling_shutter.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMaxEvents = 512;
constexpr Utime kMaxPrediction = 2'000'000;  // us beyond the last IMU sample
constexpr Utime kKeptImu = 1'000'000;        // us before the state
constexpr Utime kInitialImu = 4'000'000;     // us before the newest sample, until it has begun
constexpr double kNoHeight = 1000.0;         // m, sigma before the first depth sample
constexpr double kStillPerSecond = 2.0;      // Hz, independent zero-velocity updates
constexpr double kFrameRate = 20.0;          // Hz, usual
constexpr double kStillRateSigma = 0.003;    // rad/s

}  // namespace

VisualInertialFilter::VisualInertialFilter(VisualInertialOptions options, FilterStart start)
    : options_(std::move(options)),
      start_(std::move(start)),
      imu_((DIVE_DEMAND(options_.validate().empty()), options_)),
      state_(options_),
      visual_(options_),
      still_(options_),
      watch_(options_),
      initialiser_(options_) {
  DIVE_DEMAND(validate(start_).empty());
  estimate_.source = EstimatorKind::kVisualInertial;
}

void VisualInertialFilter::restart(FilterStart start) {
  DIVE_DEMAND(validate(start).empty());
  start_ = std::move(start);
  started_ = false;
  if (watch_.health.diverged) state_ = FilterState(options_);
  estimate_.valid = false;
  events_.clear();
  initialiser_.reset();
  ahead_.reset();
  watch_.reset(utime_, state_);
}

void VisualInertialFilter::add(const ImuSample& sample) {
  InputFaults& faults = watch_.health.faults;
  switch (imu_.add(sample)) {
    case ImuCheck::kGood:
      return;
    case ImuCheck::kSaturated:
      ++faults.imu_saturated;
      faults.last = "the IMU is saturated";
      return;
    case ImuCheck::kGap:
      ++faults.imu_gaps;
      faults.last = "samples of the IMU are missing";
      return;
    case ImuCheck::kNotFinite:
      ++faults.imu_not_finite;
      faults.last = "a sample of the IMU is not finite";
      return;
    case ImuCheck::kStamp:
      ++faults.imu_stamps;
      faults.last = fmt::format("the IMU's stamp {} does not follow the one before", sample.utime);
      return;
  }
}

void VisualInertialFilter::add(const DepthSample& sample) {
  if (!std::isfinite(sample.depth_m)) {
    ++watch_.health.faults.depth_not_finite;
    watch_.health.faults.last = "a depth sample is not finite";
    return;
  }
  push({sample.utime, sample});
}

void VisualInertialFilter::add(FeatureFrame frame) {
  const Utime utime = frame.utime + from_seconds(state_.time_offset_s);
  push({utime, std::move(frame)});
}

void VisualInertialFilter::add_speed(Utime utime, const Vector3d& v_WB_B, const Vector3d& sigma) {
  DIVE_DEMAND(v_WB_B.allFinite() && sigma.allFinite() && sigma.minCoeff() > 0.0);
  push({utime, Speed{v_WB_B, sigma}});
}

GyroBias VisualInertialFilter::gyro_bias() const {
  if (started_) {
    constexpr int kAt = imu_error::kGyroBias;
    return {state_.imu.gyro_bias, largest_sigma(state_.covariance().block<3, 3>(kAt, kAt))};
  }
  const BiasPrior prior = std::visit([](const auto& start) { return start.bias; }, start_);
  return {prior.gyro, prior.gyro_sigma.value_or(options_.gyro_bias_sigma)};
}

void VisualInertialFilter::push(Event event) {
  const auto at = std::upper_bound(events_.begin(), events_.end(), event.utime,
                                   [](Utime t, const Event& e) { return t < e.utime; });
  events_.insert(at, std::move(event));
  if (events_.size() <= kMaxEvents) return;
  events_.pop_front();
  ++watch_.health.faults.overflowed;
  watch_.health.faults.last = "measurements wait for an IMU that is silent";
}

bool VisualInertialFilter::is_due(const Event& event) const {
  if (event.utime > imu_.newest().utime) return false;
  const auto is_frame_after = [&](const Event& e) {
    return std::holds_alternative<FeatureFrame>(e.what);
  };
  return to_seconds(imu_.newest().utime - event.utime) >= options_.hold_back_s ||
         std::any_of(events_.begin(), events_.end(), is_frame_after);
}

const StateEstimate& VisualInertialFilter::update(Utime now) {
  DIVE_DEMAND(now >= estimate_.utime);
  estimate_.utime = now;
  if (!started_) try_to_start();
  if (!started_) return estimate_;
  while (!events_.empty() && is_due(events_.front())) {
    const Event event = std::move(events_.front());
    events_.pop_front();
    process(event);
  }
  // No update for too long: propagate, so that predictions do not start ever further back.
  const Utime behind = imu_.newest().utime - from_seconds(2.0 * options_.hold_back_s) - 1;
  if (behind > utime_) propagate_to(behind);
  imu_.forget_before(utime_ - kKeptImu);
  watch_.on_silence(to_seconds(now - imu_.newest().utime));
  watch_.check(std::max(utime_, std::min(now, imu_.newest().utime)), state_);
  publish(now);
  return estimate_;
}

std::optional<InitialState> VisualInertialFilter::initial_state() {
  if (imu_.empty()) return std::nullopt;
  if (const auto* const known = std::get_if<KnownStart>(&start_)) {
    return begin(*known, options_, imu_);
  }
  while (!events_.empty() && events_.front().utime <= imu_.newest().utime) {
    Event event = std::move(events_.front());
    events_.pop_front();
    if (const auto* const depth = std::get_if<DepthSample>(&event.what)) initialiser_.add(*depth);
    if (const auto* const speed = std::get_if<Speed>(&event.what)) {
      initialiser_.add(ImageStart::Speed{speed->v_B, speed->sigma.maxCoeff(), event.utime});
    }
    auto* const frame = std::get_if<FeatureFrame>(&event.what);
    if (!frame) continue;
    const Vector3d rate_B = imu_.at(event.utime).gyro_B - gyro_bias().value;
    initialiser_.add(event.utime, at_one_time(std::move(*frame), options_.cameras, rate_B));
  }
  imu_.forget_before(imu_.newest().utime - kInitialImu);
  return initialiser_.begin(std::get<ImageStart>(start_), imu_, state_);
}

void VisualInertialFilter::try_to_start() {
  const auto begun = initial_state();
  if (!begun) {
    watch_.health.waits_for =
        std::holds_alternative<ImageStart>(start_) ? initialiser_.waits_for() : "the IMU";
    return;
  }
  started_ = true;
  utime_ = begun->utime;
  last_frame_utime_ = std::numeric_limits<Utime>::min();
  state_.begin(begun->state, begun->covariance);
  if (begun->biases_at) state_.correlate_biases(*begun->biases_at);
  has_height_ = begun->has_height;
  visual_.reset();
  still_.reset();
  watch_.reset(utime_, state_);
  // Older events are part of the initialisation, or came too early.
  while (!events_.empty() && events_.front().utime <= utime_) events_.pop_front();
}

void VisualInertialFilter::process(const Event& event) {
  const auto* const frame = std::get_if<FeatureFrame>(&event.what);
  Utime utime = event.utime;
  // The offset may have changed while the frame waited.
  if (frame) utime = frame->utime + from_seconds(state_.time_offset_s);
  const bool is_old_frame = frame && frame->utime <= last_frame_utime_;
  if (utime < utime_ || is_old_frame) {
    ++watch_.health.faults.late;
    watch_.health.faults.last = frame ? "a frame came late or twice" : "a measurement came late";
    return;
  }
  propagate_to(utime);
  std::visit([this](const auto& what) { apply(what); }, event.what);
  ahead_.reset();
}

void VisualInertialFilter::apply(const DepthSample& sample) {
  if (!has_height_) state_.forget_height(kNoHeight);
  has_height_ = true;
  const ImuSystem system =
      depth_system(state_, sample.depth_m, options_.depth_sensor_B, options_.depth_sigma_m);
  watch_.on_depth(utime_, gated_correct(state_, system, options_.scalar_gate_sigma));
}

void VisualInertialFilter::apply(const Speed& speed) {
  const ImuSystem system = speed_system(state_, speed.v_B, speed.sigma);
  if (gated_correct(state_, system, options_.scalar_gate_sigma).status != UpdateStatus::kAccepted) {
    ++watch_.health.faults.speed_refused;
    watch_.health.faults.last = "the speed expected is not the one estimated";
  }
}

void VisualInertialFilter::apply(const FeatureFrame& frame) {
  const double since_last_s = to_seconds(frame.utime) - to_seconds(last_frame_utime_);
  last_frame_utime_ = frame.utime;
  const ImuReading reading = imu_.at(utime_);
  state_.clone(++frames_, utime_, reading.gyro_B - state_.imu.gyro_bias);
  watch_.on_frame(utime_, visual_.apply(state_, frame, frames_, since_last_s));
  const std::optional<double> rest_s = still_.rest_s(frame, imu_);
  watch_.health.is_at_rest = rest_s.has_value();
  if (!rest_s) return;
  // Frames repeat it more often than it is independent information.
  const double often = std::sqrt(kFrameRate / kStillPerSecond);
  // The longer the images have stood still, the slower a motion that they would not show.
  const HiddenMotion hidden = hidden_motion(options_, *rest_s);
  const ImuSystem system = zero_velocity_system(
      state_, reading.gyro_B, often * std::max(options_.zero_velocity_sigma, hidden.speed),
      often * std::max(kStillRateSigma, hidden.rate));
  watch_.on_rest(utime_, gated_correct(state_, system, options_.scalar_gate_sigma));
}

void VisualInertialFilter::propagate_to(Utime utime) {
  if (utime <= utime_) return;
  imu_.intervals(utime_, utime, intervals_);
  const ImuStep step = propagate_over(state_.imu, intervals_, options_.imu, options_.gravity);
  state_.propagate(step);
  utime_ = utime;
  ahead_.reset();
}

void VisualInertialFilter::advance(Ahead& ahead, Utime to) const {
  if (to <= ahead.utime) return;
  imu_.intervals(ahead.utime, to, intervals_);
  for (const ImuInterval& interval : intervals_) {
    const ImuStep step = propagate(ahead.state, interval, options_.imu, options_.gravity);
    ahead.covariance =
        step.transition * ahead.covariance * step.transition.transpose() + step.noise;
    ahead.state = step.state;
  }
  ahead.utime = to;
}

void VisualInertialFilter::publish(Utime now) {
  using namespace imu_error;
  if (!ahead_) {
    ahead_ = Ahead{utime_, state_.imu, state_.covariance().topLeftCorner<kSize, kSize>()};
  }
  advance(*ahead_, std::min(now, imu_.newest().utime));
  Ahead latest = *ahead_;
  advance(latest, std::min(now, imu_.newest().utime + kMaxPrediction));
  const Kinematics& motion = latest.state.motion;
  estimate_.valid = true;
  estimate_.X_WB = {motion.p_WB, motion.q_WB};
  estimate_.v_WB_B = motion.q_WB.conjugate() * motion.v_WB;
  estimate_.omega_WB_B = imu_.at(now).gyro_B - latest.state.gyro_bias;
  const Matrix15d P = 0.5 * (latest.covariance + latest.covariance.transpose());
  estimate_.covariance.topLeftCorner<3, 3>() = P.block<3, 3>(kPosition, kPosition);
  // The state's height is that by the depth sensor, whose constant error nothing observes.
  estimate_.covariance(2, 2) += std::pow(options_.depth_bias_sigma_m, 2);
  estimate_.covariance.topRightCorner<3, 3>() = P.block<3, 3>(kPosition, kAttitude);
  estimate_.covariance.bottomLeftCorner<3, 3>() = P.block<3, 3>(kAttitude, kPosition);
  estimate_.covariance.bottomRightCorner<3, 3>() = P.block<3, 3>(kAttitude, kAttitude);
}

}  // namespace dive::estimation
