#include "estimation/dataset/run_start.h"

#include <algorithm>

namespace dive::estimation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kTruthGap = 0.2;         // s
constexpr double kStartSigma = 0.01;      // m, of a position from the truth
constexpr double kUnknownSigma = 0.1;     // m, of an assumed position
constexpr double kSpeedSigma = 0.1;       // m/s, of a speed that is given
constexpr double kGyroBiasSigma = 0.005;  // rad/s, of a bias from the truth
constexpr double kAccelBiasSigma = 0.05;  // m/s^2
constexpr double kStart_s = 2.0;          // within which it begins from images
// A motion capture's frame is level, and its markers are aligned with the IMU, to about a degree.
constexpr double kTrueAttitudeSigmaDeg = 1.0;

std::optional<ImageStart::Speed> speed_at(const Recording& recording, const RunOptions& options,
                                          Utime begin) {
  const auto measured =
      std::find_if(recording.velocity.begin(), recording.velocity.end(),
                   [begin](const VelocitySample& sample) { return sample.utime >= begin; });
  if (measured != recording.velocity.end() && to_seconds(measured->utime - begin) < kStart_s) {
    return ImageStart::Speed{measured->v_B, std::max(measured->sigma, kSpeedSigma),
                             measured->utime};
  }
  if (!options.speed) return std::nullopt;
  return ImageStart::Speed{{*options.speed, 0.0, 0.0}, kSpeedSigma, std::nullopt};
}

}  // namespace

std::optional<TrueState> true_state(const Recording& recording, Utime utime) {
  const Trajectory truth = true_trajectory(recording);
  // The truth may begin later than the images.
  const auto first = std::find_if(truth.begin(), truth.end(),
                                  [&](const StampedPose& at) { return at.utime >= utime; });
  if (first == truth.end()) return std::nullopt;
  TrueState state;
  state.utime = first->utime;
  state.X_WB = first->X_WB;
  state.has_attitude = recording.has_true_attitude;
  const TruePose& pose = recording.truth[static_cast<std::size_t>(first - truth.begin())];
  const auto next = pose_at(truth, first->utime + 50'000, kTruthGap);
  if (pose.bias) {
    state.bias = BiasPrior{pose.bias->gyro, pose.bias->accel, kGyroBiasSigma, kAccelBiasSigma};
  }
  const Quaterniond q_BW = first->X_WB.q.conjugate();
  if (pose.v_W) {
    state.v_WB_B = q_BW * *pose.v_W;
  } else if (next) {
    state.v_WB_B = q_BW * (next->p - first->X_WB.p) / 0.05;
  }
  return state;
}

StartPosition start_position(const std::optional<TrueState>& truth) {
  if (truth) return {truth->X_WB.p, kStartSigma};
  return {Vector3d::Zero(), kUnknownSigma};
}

void move_to(const TrueState& truth, DatasetRun& run) {
  const auto at = std::find_if(run.estimates.begin(), run.estimates.end(),
                               [&](const StateEstimate& e) { return e.utime >= truth.utime; });
  if (at == run.estimates.end() || to_seconds(at->utime - truth.utime) > kTruthGap) return;
  Pose X;
  if (truth.has_attitude) {
    X.q = from_rpy(0.0, 0.0, to_rpy(truth.X_WB.q * at->X_WB.q.conjugate()).z());
  }
  X.p = truth.X_WB.p - X.q * at->X_WB.p;
  const Eigen::Matrix3d R = X.q.toRotationMatrix();
  for (std::vector<StateEstimate>* const estimates : {&run.estimates, &run.corrected}) {
    for (StateEstimate& estimate : *estimates) {
      estimate.X_WB = X * estimate.X_WB;
      Matrix6d& P = estimate.covariance;
      P.topRows<3>() = (R * P.topRows<3>()).eval();
      P.leftCols<3>() = (P.leftCols<3>() * R.transpose()).eval();
    }
  }
}

tl::expected<VisionStart, std::string> vision_start(const Recording& recording,
                                                    const RunOptions& options,
                                                    const std::optional<TrueState>& truth,
                                                    Utime begin) {
  if (options.start == RunStart::kTruth) {
    if (!truth || !truth->has_attitude || !truth->v_WB_B) {
      return tl::make_unexpected(
          std::string("the recording has no true poses with attitude to start from"));
    }
    KnownStart start;
    start.utime = truth->utime;
    start.X_WB = truth->X_WB;
    start.v_WB_B = *truth->v_WB_B;
    start.tilt_sigma_deg = start.yaw_sigma_deg = kTrueAttitudeSigmaDeg;
    if (truth->bias) start.bias = *truth->bias;
    return start;
  }
  const StartPosition position = start_position(truth);
  ImageStart start;
  start.position_W = position.p_W;
  start.position_sigma_m = position.sigma_m;
  if (truth && truth->has_attitude) start.heading = truth->X_WB.q;
  start.speed = speed_at(recording, options, begin);
  return start;
}

}  // namespace dive::estimation
