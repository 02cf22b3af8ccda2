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
constexpr double kDepthApart_s = 0.2;          // of a depth sample from a frame
constexpr double kSpeeds[] = {0.1, 0.4, 1.5};  // m/s, where the fits of one camera begin
constexpr double kStereoSpeed = 0.3;           // m/s, where that of two cameras begins
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
// never shows the speed better than it was given.
std::string shortcoming(const WindowFit& fit, const ImageStart& start) {
  if (fit.cost > kMaxCost || fit.outliers > kMaxOutliers || fit.behind > kMaxBehind) {
    return fmt::format(
        "features that agree with one motion ({:.0f} % do not, error {:.1f} times the noise)",
        100.0 * std::max(fit.outliers, fit.behind), std::sqrt(fit.cost));
  }
  const double speed = speed_sigma(fit);
  const double told = start.speed ? start.speed->sigma : 0.0;
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

// By the images of the last half second.
bool ImageInitialiser::is_still() const {
  const Utime since = frames_.back().utime - from_seconds(kLeast_s);
  const auto after = std::upper_bound(frames_.begin(), frames_.end(), since,
                                      [](Utime t, const Seen& seen) { return t < seen.utime; });
  if (after == frames_.begin()) return false;
  const auto motion =
      motion_between(std::prev(after)->frame, frames_.back().frame, options_.cameras.front());
  return motion && *motion <= still_motion(options_);
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

// The best of the fits that begin at several speeds: one camera's images hardly distinguish them at
// first, and a fit that begins far too slow ends there.
std::optional<WindowFit> ImageInitialiser::fit_in_motion(const ImageStart& start,
                                                         const StartWindow& window,
                                                         const std::vector<Pose>& cameras_B,
                                                         const WindowPriors& priors,
                                                         ImuState first) const {
  first.gyro_bias = fit_gyro_bias(window, cameras_B[0].q, start.bias.gyro, priors.gyro_bias_sigma);
  const auto motion = find_first_motion(window, cameras_B[0], first.gyro_bias);
  if (!motion) return std::nullopt;
  std::vector<double> speeds(std::begin(kSpeeds), std::end(kSpeeds));
  if (start.speed) speeds = {start.speed->v_WB_B.norm()};
  if (cameras_B.size() > 1) speeds = {kStereoSpeed};
  std::vector<WindowFit> fits;
  for (const double speed : speeds) {
    first.motion.q_WB = upright(motion->up_B, start.heading);
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

std::optional<InitialState> ImageInitialiser::fit(const ImageStart& start, bool is_at_rest,
                                                  const StartWindow& window,
                                                  const FilterState& calibrated) {
  const ImuReading mean = mean_reading(window);
  if (std::abs(mean.accel_B.norm() - options_.gravity) > kGravityShare * options_.gravity) {
    waits_for_ = fmt::format("an accelerometer that measures gravity: its mean is {:.1f} m/s^2",
                             mean.accel_B.norm());
    return std::nullopt;
  }
  ImuState first;
  first.intrinsics = calibrated.imu.intrinsics;
  first.gyro_bias = is_at_rest ? mean.gyro_B : start.bias.gyro;
  first.accel_bias = start.bias.accel;
  first.motion.q_WB = upright(mean.accel_B, start.heading);
  first.motion.p_WB = start.position_W;
  if (window.depth_m.front()) {
    first.motion.p_WB.z() =
        -*window.depth_m.front() - (first.motion.q_WB * options_.depth_sensor_B).z();
  }
  WindowPriors priors;
  priors.position_sigma_m = start.position_sigma_m;
  priors.heading_sigma = deg_to_rad(start.heading_sigma_deg);
  priors.bias.gyro_bias = start.bias.gyro;
  priors.bias.accel_bias = start.bias.accel;
  priors.gyro_bias_sigma = start.bias.gyro_sigma.value_or(options_.gyro_bias_sigma);
  priors.accel_bias_sigma = start.bias.accel_sigma.value_or(options_.accel_bias_sigma);
  priors.is_at_rest = is_at_rest;
  if (start.speed && !is_at_rest) {
    priors.speed = WindowPriors::Speed{start.speed->v_WB_B, start.speed->sigma};
  }
  const auto result = is_at_rest
                          ? fit_window(window, options_, calibrated.cameras_B, first, priors)
                          : fit_in_motion(start, window, calibrated.cameras_B, priors, first);
  if (!result) {
    waits_for_ = "features that determine a motion";
    return std::nullopt;
  }
  if (waits_for_ = shortcoming(*result, start); !waits_for_.empty()) return std::nullopt;
  const ImuReading unbiased{mean.gyro_B - result->last.gyro_bias,
                            mean.accel_B - result->last.accel_bias};
  return InitialState{window.utimes.back(), result->last, kSafety * kSafety * result->covariance,
                      unbiased};
}

std::optional<InitialState> ImageInitialiser::begin(const ImageStart& start, const ImuBuffer& imu,
                                                    const FilterState& calibrated) {
  if (imu.empty()) {
    waits_for_ = "the IMU";
    return std::nullopt;
  }
  if (frames_.empty()) return std::nullopt;
  const Utime last = frames_.back().utime;
  if (imu.newest().utime < last || to_seconds(last - tried_) < kRetry_s) return std::nullopt;
  const double span = to_seconds(last - std::max(frames_.front().utime, imu.oldest()));
  if (span < kLeast_s) {
    waits_for_ = fmt::format("half a second of images; {:.2f} s have come", std::max(span, 0.0));
    return std::nullopt;
  }
  tried_ = last;
  const bool is_at_rest = is_still();
  const StartWindow chosen = window(is_at_rest ? kLeast_s + 0.1 : kMost_s, imu);
  if (chosen.tracks.size() < kMinStartFeatures) {
    waits_for_ = fmt::format("features that last: {} of {} are seen long enough",
                             chosen.tracks.size(), frames_.back().frame.features.size());
    return std::nullopt;
  }
  return fit(start, is_at_rest, chosen, calibrated);
}

}  // namespace dive::estimation
