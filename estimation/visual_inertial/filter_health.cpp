#include "estimation/visual_inertial/filter_health.h"

#include <cmath>

#include <fmt/format.h>

namespace dive::estimation {
namespace {

constexpr double kBlind_s = 1.0;
constexpr double kSmoothing = 0.05;           // share of the newest innovation ratio
constexpr std::int64_t kEnoughRefusals = 10;  // before they say anything
constexpr double kMostGyroBias = 0.5;         // rad/s
constexpr double kMostAccelBias = 3.0;        // m/s^2

}  // namespace

void HealthWatch::reset(Utime utime) {
  const InputFaults faults = health.faults;
  health = {};
  health.faults = faults;
  visual_ = depth_ = utime;
  depth_refused_ = visual_refused_ = 0;
}

void HealthWatch::diverge(std::string reason) {
  if (health.diverged) return;
  health.diverged = true;
  health.reason = std::move(reason);
}

void HealthWatch::on_depth(Utime utime, const UpdateResult& result) {
  health.depth_innovation_ratio += kSmoothing * (result.ratio - health.depth_innovation_ratio);
  if (result.verdict == Verdict::kAccepted) {
    depth_ = utime;
    depth_refused_ = 0;
    return;
  }
  ++health.faults.depth_refused;
  ++depth_refused_;
  health.faults.last = fmt::format("depth is {:.1f} sigma off", std::sqrt(result.ratio));
  const double since = to_seconds(utime - depth_);
  if (depth_refused_ >= kEnoughRefusals && since > options_.max_rejection_s) {
    diverge(fmt::format("depth and the filter disagree for {:.1f} s", since));
  }
}

void HealthWatch::on_frame(Utime utime, VisualReport report) {
  health.faults.features_ignored += report.ignored;
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

void HealthWatch::on_silence(double seconds) {
  if (seconds > options_.max_rejection_s) {
    diverge(fmt::format("no IMU for {:.1f} s", seconds));
  }
}

void HealthWatch::check(Utime utime, const FilterState& state) {
  health.since_visual_s = to_seconds(utime - visual_);
  health.is_blind = health.since_visual_s > kBlind_s;
  if (!state.is_finite()) return diverge("the state is not finite");
  const auto P = state.covariance();
  const double speed = state.imu.motion.v_WB.norm();
  const double position = std::sqrt(P.diagonal().segment<2>(imu_error::kPosition).maxCoeff());
  const double attitude =
      rad_to_deg(std::sqrt(P.diagonal().segment<3>(imu_error::kAttitude).maxCoeff()));
  if (speed > options_.max_speed) {
    diverge(fmt::format("a speed of {:.1f} m/s is none of this vehicle", speed));
  } else if (position > options_.max_position_sigma_m) {
    diverge(fmt::format("the position is known to {:.1f} m only", position));
  } else if (attitude > options_.max_attitude_sigma_deg) {
    diverge(fmt::format("the attitude is known to {:.1f} degrees only", attitude));
  } else if (state.imu.gyro_bias.norm() > kMostGyroBias) {
    diverge(fmt::format("a gyro bias of {:.2f} rad/s is none", state.imu.gyro_bias.norm()));
  } else if (state.imu.accel_bias.norm() > kMostAccelBias) {
    diverge(
        fmt::format("an accelerometer bias of {:.1f} m/s^2 is none", state.imu.accel_bias.norm()));
  }
}

}  // namespace dive::estimation
