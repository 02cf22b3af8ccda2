#include "estimation/visual_inertial/filter/image_start.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "estimation/visual_inertial/filter/first_motion.h"
#include "estimation/visual_inertial/filter/gyro_bias_fit.h"
#include "estimation/visual_inertial/filter/image_motion.h"
#include "estimation/visual_inertial/filter/window_fit.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kLeast_s = 0.45;              // of images, for any initialisation
constexpr double kMost_s = 2.0;                // of images that are used
constexpr double kRetry_s = 0.2;               // between two attempts
constexpr double kLongGap_s = 0.5;             // between two images, after which it begins again
constexpr double kDepthApart_s = 0.6;          // between two depth samples about a frame
constexpr double kSpeeds[] = {0.1, 0.4, 1.5};  // m/s, where the fits of one camera begin
constexpr double kStereoSpeed = 0.3;           // m/s, where that of two cameras begins
constexpr double kMaxKnownSpeedSigma = 0.2;    // m/s, of a speed that counts as known
constexpr double kUnknownHeight = 10.0;        // m, of the first image before depth is used
constexpr double kUnknownSpeed = 1.0;          // m/s, of a vehicle that is not observed
constexpr double kAsGood = 9.0;                // of the cost: three sigma
constexpr double kGravityShare = 0.3;          // difference of the mean specific force from gravity
constexpr std::size_t kMinStartFeatures = 15;
constexpr std::size_t kMaxFrames = 10;  // of a window
constexpr std::size_t kMaxTracks = 60;
constexpr std::size_t kMinViews = 3;  // frames that see a track
// What a fit must reach:
constexpr double kMaxSpeedSigma = 0.04;     // m/s, the largest of an axis
constexpr double kMaxSpeedShare = 0.05;     // of the speed
constexpr double kMaxTilt = 0.06;           // rad
constexpr double kMaxGyroBiasSigma = 0.03;  // rad/s
constexpr double kMaxCost = 2.5;            // per degree of freedom of the images
constexpr double kMaxOutliers = 0.15;
constexpr double kMaxBehind = 0.15;
constexpr double kSafety = 1.2;  // of the sigmas: of a linearised problem

// The attitude with up_B upwards and the heading of `like`.
Quaterniond upright(const Vector3d& up_B, const Quaterniond& like) {
  Quaterniond level = Quaterniond::FromTwoVectors(up_B, Vector3d::UnitZ());
  const Quaterniond turn = like * level.conjugate();
  const double norm = std::hypot(turn.w(), turn.z());
  if (!(norm > 1e-6)) return level;  // upside down: any heading is as near
  return (Quaterniond(turn.w() / norm, 0.0, 0.0, turn.z() / norm) * level).normalized();
}

// By the gyro; both times within the buffer's, or the nearest reading is used.
Quaterniond turn_over(const ImuBuffer& imu, Utime from, Utime to, const Vector3d& gyro_bias) {
  Quaterniond turned = Quaterniond::Identity();
  if (to <= from) return turned;
  std::vector<ImuInterval> intervals;
  imu.intervals(from, to, intervals);
  for (const ImuInterval& at : intervals) {
    turned = turned * so3_exp(at.dt * (0.5 * (at.begin.gyro_B + at.end.gyro_B) - gyro_bias));
  }
  return turned.normalized();
}

// A pair of cameras of which one sees nothing is one camera.
bool sees_with_two_cameras(const StartWindow& window) {
  const auto pairs = std::ranges::count_if(window.tracks, [](const FeatureTrack& track) {
    return std::ranges::any_of(track.observations,
                               [](const auto& o) { return o.right.has_value(); });
  });
  return static_cast<std::size_t>(pairs) >= kMinStartFeatures;
}

ImuReading mean_reading(const StartWindow& window) {
  ImuReading mean;
  double seconds = 0.0;
  for (const auto& imu : window.imu) {
    for (const ImuInterval& interval : imu) {
      mean.gyro_B += 0.5 * interval.dt * (interval.begin.gyro_B + interval.end.gyro_B);
      mean.accel_B += 0.5 * interval.dt * (interval.begin.accel_B + interval.end.accel_B);
      seconds += interval.dt;
    }
  }
  mean.gyro_B /= seconds;
  mean.accel_B /= seconds;
  return mean;
}

// Largest sigma of the velocity in B, m/s: that in W contains the heading's, which no image tells.
double speed_sigma(const WindowFit& fit) {
  using namespace imu_error;
  const Matrix3d R_BW = fit.last.motion.q_WB.conjugate().toRotationMatrix();
  const Matrix3d by_attitude = skew(R_BW * fit.last.motion.v_WB);
  const Matrix15d& P = fit.covariance;
  const Matrix3d cross = by_attitude * P.block<3, 3>(kAttitude, kVelocity) * R_BW.transpose();
  return largest_sigma(by_attitude * P.block<3, 3>(kAttitude, kAttitude) * by_attitude.transpose() +
                       R_BW * P.block<3, 3>(kVelocity, kVelocity) * R_BW.transpose() + cross +
                       cross.transpose());
}

// Largest sigma of a horizontal axis, rad.
double tilt_sigma(const WindowFit& fit) {
  using namespace imu_error;
  const Matrix3d R_WB = fit.last.motion.q_WB.toRotationMatrix();
  Matrix3d P_W = R_WB * fit.covariance.block<3, 3>(kAttitude, kAttitude) * R_WB.transpose();
  P_W.row(2).setZero();
  P_W.col(2).setZero();
  return largest_sigma(P_W);
}

// Empty if the fit determines the state, else what is missing. At constant velocity one camera
// never shows the speed better than it was given: `told`, m/s.
std::string shortcoming(const WindowFit& fit, double told) {
  if (fit.cost > kMaxCost || fit.outliers > kMaxOutliers || fit.behind > kMaxBehind) {
    return fmt::format(
        "features that agree with one motion ({:.0f} % do not, error {:.1f} times the noise)",
        100.0 * std::max(fit.outliers, fit.behind), std::sqrt(fit.cost));
  }
  const double speed = speed_sigma(fit);
  if (speed > std::max({kMaxSpeedSigma, kMaxSpeedShare * fit.last.motion.v_WB.norm(), told})) {
    return fmt::format("a change of speed, or a known speed: it is known to {:.2f} m/s only",
                       speed);
  }
  const double tilt = tilt_sigma(fit);
  const double gyro =
      largest_sigma(fit.covariance.block<3, 3>(imu_error::kGyroBias, imu_error::kGyroBias));
  if (gyro > kMaxGyroBiasSigma || tilt > kMaxTilt) {
    return fmt::format("more images: the gyro's bias is known to {:.3f} rad/s, tilt to {:.1f} deg",
                       gyro, rad_to_deg(tilt));
  }
  return {};
}

}  // namespace

void ImageInitialiser::reset() {
  frames_.clear();
  depth_.clear();
  measured_.reset();
  since_.reset();
  turned_at_.reset();
  turned_ = Quaterniond::Identity();
  tried_ = 0;
  waits_for_ = "images";
}

void ImageInitialiser::add(const DepthSample& sample) {
  depth_.push_back(sample);
  while (to_seconds(depth_.back().utime - depth_.front().utime) > 2.0 * kMost_s) {
    depth_.pop_front();
  }
}

void ImageInitialiser::add(Utime utime, FeatureFrame frame) {
  if (!frames_.empty()) {
    const double since = to_seconds(utime - frames_.back().utime);
    if (since <= 0.0) return;
    if (since > kLongGap_s) frames_.clear();
  }
  if (frame.features.size() < kMinStartFeatures) {
    waits_for_ = fmt::format("images with at least {} features: the last one has {}",
                             kMinStartFeatures, frame.features.size());
    return;
  }
  frames_.push_back({utime, std::move(frame)});
  while (to_seconds(utime - frames_.front().utime) > kMost_s) frames_.pop_front();
}

// Seconds up to the last image in which nothing has moved; empty if less than half a second.
std::optional<double> ImageInitialiser::rest_s() const {
  for (const double seconds : {kMost_s - 0.1, kLeast_s}) {
    const Utime since = frames_.back().utime - from_seconds(seconds);
    const auto after = std::upper_bound(frames_.begin(), frames_.end(), since,
                                        [](Utime t, const Seen& seen) { return t < seen.utime; });
    if (after == frames_.begin()) continue;
    const auto motion =
        motion_between(std::prev(after)->frame, frames_.back().frame, options_.cameras.front());
    if (motion && *motion <= still_motion(options_)) return seconds;
  }
  return std::nullopt;
}

std::optional<double> ImageInitialiser::depth_at(Utime utime) const {
  const auto after = std::lower_bound(depth_.begin(), depth_.end(), utime,
                                      [](const DepthSample& s, Utime t) { return s.utime < t; });
  if (after == depth_.end() || after == depth_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double span = to_seconds(after->utime - before->utime);
  if (!(span > 0.0) || span > kDepthApart_s) return std::nullopt;
  const double t = to_seconds(utime - before->utime) / span;
  return before->depth_m + t * (after->depth_m - before->depth_m);
}

void ImageInitialiser::follow(const std::vector<const Seen*>& chosen, StartWindow& window) const {
  std::map<std::int64_t, FeatureTrack> tracks;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    for (const FeatureObservation& feature : chosen[k]->frame.features) {
      const auto frame = static_cast<std::int64_t>(k);
      const auto observation = observation_of(feature, frame, options_.cameras);
      if (!observation) continue;
      FeatureTrack& track = tracks[feature.id];
      if (!track.observations.empty() && track.last_frame == frame) continue;
      track.id = feature.id;
      track.last_frame = frame;
      track.observations.push_back(*observation);
    }
  }
  for (auto& [id, track] : tracks) {
    if (track.observations.size() >= kMinViews) window.tracks.push_back(std::move(track));
  }
  std::stable_sort(window.tracks.begin(), window.tracks.end(),
                   [](const FeatureTrack& a, const FeatureTrack& b) {
                     return a.observations.size() > b.observations.size();
                   });
  if (window.tracks.size() > kMaxTracks) window.tracks.resize(kMaxTracks);
}

StartWindow ImageInitialiser::window(double seconds, const ImuBuffer& imu) const {
  const Utime since = std::max(frames_.back().utime - from_seconds(seconds), imu.oldest());
  std::vector<const Seen*> usable;
  for (const Seen& seen : frames_) {
    if (seen.utime >= since) usable.push_back(&seen);
  }
  const std::size_t count = std::min(usable.size(), kMaxFrames);
  std::vector<const Seen*> chosen;
  chosen.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    chosen.push_back(usable[count == 1 ? 0 : i * (usable.size() - 1) / (count - 1)]);
  }
  StartWindow window;
  window.sigma = options_.pixel_sigma / options_.cameras.front().focal();
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    window.utimes.push_back(chosen[k]->utime);
    window.depth_m.push_back(depth_at(chosen[k]->utime));
    window.gyro_B.push_back(imu.at(chosen[k]->utime).gyro_B);
    if (k == 0) continue;
    window.imu.emplace_back();
    imu.intervals(chosen[k - 1]->utime, chosen[k]->utime, window.imu.back());
  }
  follow(chosen, window);
  return window;
}

// The speed as it is known at the frame nearest to its time; one of another time says less.
std::optional<WindowPriors::Speed> ImageInitialiser::speed_in(const ImageStart& start,
                                                              const StartWindow& window) const {
  const std::optional<ImageStart::Speed>& known = measured_ ? measured_ : start.speed;
  if (!known) return std::nullopt;
  WindowPriors::Speed speed{known->v_WB_B, known->sigma, window.size() - 1};
  if (!known->utime) return speed;
  const auto apart = [&](std::size_t frame) {
    return std::abs(to_seconds(window.utimes[frame] - *known->utime));
  };
  for (std::size_t frame = 0; frame < window.size(); ++frame) {
    if (apart(frame) < apart(speed.frame)) speed.frame = frame;
  }
  speed.sigma = std::hypot(speed.sigma, options_.unknown_accel_sigma * apart(speed.frame));
  if (speed.sigma > kMaxKnownSpeedSigma) return std::nullopt;
  return speed;
}

// Turns the heading to the oldest image in the window by the gyro.
void ImageInitialiser::follow_heading(const ImageStart& start, const ImuBuffer& imu) {
  const Utime to =
      frames_.empty() ? imu.newest().utime - from_seconds(kMost_s) : frames_.front().utime;
  if (!since_) {
    if (frames_.empty() && !start.utime) return;
    since_ = turned_at_ = start.utime.value_or(to);
  }
  if (to <= *turned_at_) return;
  turned_ = (turned_ * turn_over(imu, *turned_at_, to, start.bias.gyro)).normalized();
  turned_at_ = to;
}

// The best of the fits that begin at several speeds: one camera's images hardly distinguish them at
// first, and a fit that begins far too slow ends there.
std::optional<WindowFit> ImageInitialiser::fit_in_motion(const StartWindow& window,
                                                         const std::vector<Pose>& cameras_B,
                                                         const WindowPriors& priors,
                                                         ImuState first) const {
  first.gyro_bias =
      fit_gyro_bias(window, cameras_B[0].q, priors.bias.gyro_bias, priors.gyro_bias_sigma);
  const auto motion = find_first_motion(window, cameras_B[0], first.gyro_bias);
  if (!motion) return std::nullopt;
  std::vector<double> speeds(std::begin(kSpeeds), std::end(kSpeeds));
  if (priors.speed) speeds = {priors.speed->v_B.norm()};
  if (sees_with_two_cameras(window)) speeds = {kStereoSpeed};
  std::vector<WindowFit> fits;
  for (const double speed : speeds) {
    first.motion.q_WB = upright(motion->up_B, first.motion.q_WB);
    first.motion.v_WB = first.motion.q_WB * motion->velocity(speed);
    const auto fit = fit_window(window, options_, cameras_B, first, priors);
    if (fit) fits.push_back(*fit);
  }
  if (fits.empty()) return std::nullopt;
  WindowFit best = *std::min_element(
      fits.begin(), fits.end(), [](const auto& a, const auto& b) { return a.total < b.total; });
  for (const WindowFit& other : fits) {
    if (other.total > best.total + kAsGood) continue;
    const Vector3d apart = other.last.motion.v_WB - best.last.motion.v_WB;
    best.covariance.block<3, 3>(imu_error::kVelocity, imu_error::kVelocity) +=
        apart * apart.transpose();
  }
  return best;
}

std::optional<InitialState> ImageInitialiser::fit(const ImageStart& start,
                                                  std::optional<double> rest_s,
                                                  const StartWindow& window, const ImuBuffer& imu,
                                                  const FilterState& calibrated) {
  const ImuReading mean = mean_reading(window);
  if (std::abs(mean.accel_B.norm() - options_.gravity) > kGravityShare * options_.gravity) {
    waits_for_ = fmt::format("an accelerometer that measures gravity: its mean is {:.1f} m/s^2",
                             mean.accel_B.norm());
    return std::nullopt;
  }
  ImuState first;
  first.intrinsics = calibrated.imu.intrinsics;
  first.gyro_bias = rest_s ? mean.gyro_B : start.bias.gyro;
  first.accel_bias = start.bias.accel;
  const Quaterniond turned =
      turned_ * turn_over(imu, *turned_at_, window.utimes.front(), start.bias.gyro);
  first.motion.q_WB = upright(mean.accel_B, start.heading * turned);
  first.motion.p_WB = start.position_W;
  WindowPriors priors;
  priors.bias.gyro_bias = start.bias.gyro;
  priors.bias.accel_bias = start.bias.accel;
  priors.gyro_bias_sigma = start.bias.gyro_sigma.value_or(options_.gyro_bias_sigma);
  const double since_s = std::max(to_seconds(window.utimes.front() - *since_), 0.0);
  priors.position_sigma_m.setConstant(std::hypot(start.position_sigma_m, kUnknownSpeed * since_s));
  const auto depth = std::ranges::find_if(window.depth_m, &std::optional<double>::has_value);
  const bool has_depth = depth != window.depth_m.end();
  if (has_depth) {
    // The height is that of the depth sensor, wherever the position was.
    first.motion.p_WB.z() = -**depth - (first.motion.q_WB * options_.depth_sensor_B).z();
    priors.position_sigma_m.z() = kUnknownHeight;
  }
  priors.heading_sigma =
      std::hypot(deg_to_rad(start.heading_sigma_deg), priors.gyro_bias_sigma * since_s);
  priors.accel_bias_sigma = start.bias.accel_sigma.value_or(options_.accel_bias_sigma);
  priors.speed = speed_in(start, window);
  if (rest_s) {
    priors.rest_sigma =
        std::max(options_.zero_velocity_sigma, hidden_motion(options_, *rest_s).speed);
  }
  const auto result = rest_s ? fit_window(window, options_, calibrated.cameras_B, first, priors)
                             : fit_in_motion(window, calibrated.cameras_B, priors, first);
  if (!result) {
    waits_for_ = "features that determine a motion";
    return std::nullopt;
  }
  double told = 0.0;
  if (priors.speed) {
    const Utime since = window.utimes[priors.speed->frame];
    told = std::hypot(priors.speed->sigma,
                      priors.accel_bias_sigma * to_seconds(window.utimes.back() - since));
  }
  if (waits_for_ = shortcoming(*result, told); !waits_for_.empty()) return std::nullopt;
  const ImuReading unbiased{mean.gyro_B - result->last.gyro_bias,
                            mean.accel_B - result->last.accel_bias};
  return InitialState{window.utimes.back(), result->last, kSafety * kSafety * result->covariance,
                      unbiased, has_depth};
}

std::optional<InitialState> ImageInitialiser::begin(const ImageStart& start, const ImuBuffer& imu,
                                                    const FilterState& calibrated) {
  if (imu.empty()) {
    waits_for_ = "the IMU";
    return std::nullopt;
  }
  follow_heading(start, imu);
  if (frames_.empty()) return std::nullopt;
  const Utime last = frames_.back().utime;
  if (imu.newest().utime < last || to_seconds(last - tried_) < kRetry_s) return std::nullopt;
  const double span = to_seconds(last - std::max(frames_.front().utime, imu.oldest()));
  if (span < kLeast_s) {
    waits_for_ = fmt::format("half a second of images; {:.2f} s have come", std::max(span, 0.0));
    return std::nullopt;
  }
  tried_ = last;
  const std::optional<double> rest = rest_s();
  const StartWindow chosen = window(rest ? *rest + 0.1 : kMost_s, imu);
  if (chosen.tracks.size() < kMinStartFeatures) {
    waits_for_ = fmt::format("features that last: {} of {} are seen long enough",
                             chosen.tracks.size(), frames_.back().frame.features.size());
    return std::nullopt;
  }
  return fit(start, rest, chosen, imu, calibrated);
}

}  // namespace dive::estimation
