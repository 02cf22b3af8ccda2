#include "estimation/visual_inertial/filter/filter_health.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace dive::estimation {
namespace {

using Eigen::Vector3d;

constexpr double kBlind_s = 1.0;
constexpr double kSmoothing = 0.05;           // weight of the newest innovation ratio
constexpr std::int64_t kEnoughRefusals = 10;  // minimum number for a decision
constexpr double kMaxGyroBias = 0.5;          // rad/s
constexpr double kMaxAccelBias = 3.0;         // m/s^2
constexpr double kShareSmoothing = 0.15;      // weight of the newest: reacts within half a second
// Limits beyond which the filter is suspect:
constexpr double kMaxRejectedShare = 0.5;
constexpr double kMaxVisualRatio = 1.6;
constexpr double kMaxDepthRatio = 4.0;
constexpr double kMaxCalibrationSigmas = 6.0;  // of calibrated values from their configured ones
constexpr double kSuspectTime_s = 10.0;        // duration of the suspicion

Vector6d biases(const FilterState& state) {
  Vector6d both;
  both << state.imu.gyro_bias, state.imu.accel_bias;
  return both;
}

// Largest difference from an initial bias in sigmas; the bias walks meanwhile.
double sigmas_off(const Vector3d& difference, const Vector3d& sigma, double walk, double seconds) {
  const Eigen::Array3d variance = sigma.array().square() + walk * walk * seconds;
  return (difference.array().square() / variance).sqrt().maxCoeff();
}

}  // namespace

void HealthWatch::reset(Utime utime, const FilterState& state) {
  const InputFaults faults = health.faults;
  const std::int64_t features_used = health.features_used;
  health = {};
  health.faults = faults;
  health.features_used = features_used;
  visual_ = depth_ = begun_ = utime;
  initial_bias_ = biases(state);
  initial_sigma_ = state.covariance().diagonal().segment<6>(imu_error::kGyroBias).cwiseSqrt();
  depth_refused_ = visual_refused_ = 0;
  refused_share_ = 0.0;
  suspected_at_.reset();
}

void HealthWatch::diverge(std::string reason) {
  if (health.diverged) return;
  health.diverged = true;
  health.reason = std::move(reason);
}

void HealthWatch::on_depth(Utime utime, const UpdateResult& result) {
  health.depth_innovation_ratio += kSmoothing * (result.ratio - health.depth_innovation_ratio);
  if (result.status == UpdateStatus::kAccepted) {
    depth_ = utime;
    depth_refused_ = 0;
    health.depth_fault = false;
    return;
  }
  ++health.faults.depth_refused;
  ++depth_refused_;
  health.faults.last = fmt::format("depth is {:.1f} sigma off", std::sqrt(result.ratio));
  const double since = to_seconds(utime - depth_);
  if (depth_refused_ < kEnoughRefusals || since <= options_.max_rejection_s) return;
  if (to_seconds(utime - visual_) < kBlind_s) {
    health.depth_fault = true;
    health.faults.last = fmt::format(
        "depth has disagreed with the images for {:.1f} s: the sensor is ignored", since);
  } else {
    diverge(fmt::format("depth and the filter disagree for {:.1f} s", since));
  }
}

void HealthWatch::on_frame(Utime utime, VisualReport report) {
  health.faults.features_ignored += report.ignored;
  health.faults.features_refused += report.rejected;
  health.features_used += report.used;
  if (const int checked = report.used + report.rejected; checked > 0) {
    const double share = static_cast<double>(report.rejected) / checked;
    refused_share_ += kShareSmoothing * (share - refused_share_);
  }
  if (report.used > 0) {
    visual_ = utime;
    visual_refused_ = 0;
    health.visual_innovation_ratio +=
        kSmoothing * (report.innovation_ratio - health.visual_innovation_ratio);
  } else {
    visual_refused_ += report.rejected;
  }
  health.visual = std::move(report);
  const double since = to_seconds(utime - visual_);
  if (visual_refused_ >= kEnoughRefusals && since > options_.max_rejection_s) {
    diverge(fmt::format("features and the filter disagree for {:.1f} s", since));
  }
}

void HealthWatch::on_rest(Utime utime, const UpdateResult& result) {
  if (result.status == UpdateStatus::kAccepted) visual_ = utime;
}

void HealthWatch::on_silence(double seconds) {
  if (seconds > options_.max_rejection_s) {
    diverge(fmt::format("no IMU for {:.1f} s", seconds));
  }
}

std::string HealthWatch::suspicion_of(Utime utime, const FilterState& state) const {
  if (refused_share_ > kMaxRejectedShare) {
    return fmt::format("{:.0f} % of the observations do not fit", 100.0 * refused_share_);
  }
  if (health.visual_innovation_ratio > kMaxVisualRatio) {
    return fmt::format("the visual errors are {:.1f} times as large as they should be",
                       std::sqrt(health.visual_innovation_ratio));
  }
  if (health.depth_innovation_ratio > kMaxDepthRatio) {
    return fmt::format("depth errs {:.1f} times as much as it should",
                       std::sqrt(health.depth_innovation_ratio));
  }
  const double seconds = to_seconds(utime - begun_);
  const Vector6d change = biases(state) - initial_bias_;
  const double gyro =
      sigmas_off(change.head<3>(), initial_sigma_.head<3>(), options_.imu.gyro_walk, seconds);
  if (gyro > kMaxCalibrationSigmas) return fmt::format("the gyro's bias is {:.0f} sigma off", gyro);
  const double accel =
      sigmas_off(change.tail<3>(), initial_sigma_.tail<3>(), options_.imu.accel_walk, seconds);
  if (accel > kMaxCalibrationSigmas) {
    return fmt::format("the accelerometer's bias is {:.0f} sigma off", accel);
  }
  for (std::size_t i = 0; options_.calibrate_extrinsics && i < state.cameras_B.size(); ++i) {
    const Pose& calibrated = options_.cameras[i].X_BC;
    const Vector3d turn = so3_log(calibrated.q.conjugate() * state.cameras_B[i].q);
    const double turned = turn.cwiseAbs().maxCoeff() / deg_to_rad(options_.extrinsic_sigma_deg);
    const double moved =
        (state.cameras_B[i].p - calibrated.p).cwiseAbs().maxCoeff() / options_.extrinsic_sigma_m;
    if (std::max(turned, moved) > kMaxCalibrationSigmas) {
      return fmt::format("camera {} stands {:.0f} sigma off", i, std::max(turned, moved));
    }
  }
  return {};
}

void HealthWatch::check(Utime utime, const FilterState& state) {
  health.since_visual_s = to_seconds(utime - visual_);
  health.is_blind = health.since_visual_s > kBlind_s;
  if (!state.is_finite()) return diverge("the state is not finite");
  std::string suspicion = suspicion_of(utime, state);
  const std::int64_t unmeasured = health.faults.imu_saturated + health.faults.imu_gaps;
  if (unmeasured > unmeasured_) suspicion = "the IMU does not measure all that happens";
  unmeasured_ = unmeasured;
  if (!suspicion.empty()) {
    suspected_at_ = utime;
    health.suspicion = std::move(suspicion);
  }
  health.is_suspect = suspected_at_ && to_seconds(utime - *suspected_at_) < kSuspectTime_s;
  const auto P = state.covariance();
  const double speed = state.imu.motion.v_WB.norm();
  const double position = std::sqrt(P.diagonal().segment<2>(imu_error::kPosition).maxCoeff());
  const double attitude =
      rad_to_deg(std::sqrt(P.diagonal().segment<3>(imu_error::kAttitude).maxCoeff()));
  if (speed > options_.max_speed) {
    diverge(fmt::format("a speed of {:.1f} m/s is implausible for this vehicle", speed));
  } else if (position > options_.max_position_sigma_m) {
    diverge(fmt::format("the position is known to {:.1f} m only", position));
  } else if (attitude > options_.max_attitude_sigma_deg) {
    diverge(fmt::format("the attitude is known to {:.1f} degrees only", attitude));
  } else if (state.imu.gyro_bias.norm() > kMaxGyroBias) {
    diverge(fmt::format("a gyro bias of {:.2f} rad/s is none", state.imu.gyro_bias.norm()));
  } else if (state.imu.accel_bias.norm() > kMaxAccelBias) {
    diverge(
        fmt::format("an accelerometer bias of {:.1f} m/s^2 is none", state.imu.accel_bias.norm()));
  }
}

}  // namespace dive::estimation
