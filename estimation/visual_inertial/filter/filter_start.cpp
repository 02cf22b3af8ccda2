#include "estimation/visual_inertial/filter/filter_start.h"

#include <algorithm>
#include <cmath>

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kRest_s = 0.5;
constexpr double kFreshDepth_s = 0.5;
constexpr double kRestSpeedSigma = 0.02;      // m/s
constexpr double kRestGyroBiasSigma = 0.001;  // rad/s

struct Sigmas {
  Vector3d position;  // per axis of W
  double tilt;
  double yaw;
  double speed;
  double gyro_bias;
  double accel_bias;
};

// Tilt and yaw are about the axes of W, the error of the attitude is expressed in B.
Matrix15d covariance(const Sigmas& s, const Eigen::Quaterniond& q_WB) {
  using namespace imu_error;
  Matrix15d P = Matrix15d::Zero();
  const Matrix3d R_WB = q_WB.toRotationMatrix();
  const Vector3d attitude(s.tilt * s.tilt, s.tilt * s.tilt, s.yaw * s.yaw);
  P.block<3, 3>(kAttitude, kAttitude) = R_WB.transpose() * attitude.asDiagonal() * R_WB;
  P.diagonal().segment<3>(kPosition) = s.position.cwiseAbs2();
  P.diagonal().segment<3>(kVelocity).setConstant(s.speed * s.speed);
  P.diagonal().segment<3>(kGyroBias).setConstant(s.gyro_bias * s.gyro_bias);
  P.diagonal().segment<3>(kAccelBias).setConstant(s.accel_bias * s.accel_bias);
  return 0.5 * (P + P.transpose());
}

// p_z = -depth - (R l)_z
void take_depth(ImuState& state, Sigmas& sigmas, const VisualInertialOptions& options,
                const DepthSample& depth) {
  state.motion.p_WB.z() = -depth.depth_m - (state.motion.q_WB * options.depth_sensor_B).z();
  sigmas.position.z() = options.depth_sigma_m;
}

std::optional<InitialState> begin(const MotionStart& start, const VisualInertialOptions& options,
                                  const ImuBuffer& imu, const std::optional<DepthSample>& depth) {
  if (imu.empty() || !depth) return std::nullopt;
  const ImuSample& newest = imu.newest();
  if (std::abs(to_seconds(newest.utime - depth->utime)) > kFreshDepth_s) return std::nullopt;
  if (!(std::abs(newest.q_WB.norm() - 1.0) < 0.01)) return std::nullopt;
  ImuState state;
  state.motion.q_WB = newest.q_WB.normalized();
  state.motion.p_WB = start.position_W;
  state.motion.v_WB = state.motion.q_WB * start.v_WB_B;
  Sigmas sigmas{Vector3d::Constant(start.position_sigma_m),
                deg_to_rad(start.tilt_sigma_deg),
                deg_to_rad(start.heading_sigma_deg),
                start.speed_sigma,
                options.gyro_bias_sigma,
                options.accel_bias_sigma};
  take_depth(state, sigmas, options, *depth);
  // Bound on the change of height between the two samples: this speed.
  sigmas.position.z() +=
      std::abs(to_seconds(newest.utime - depth->utime)) * (start.v_WB_B.norm() + start.speed_sigma);
  return InitialState{newest.utime, state, covariance(sigmas, state.motion.q_WB)};
}

std::optional<InitialState> begin(const RestStart& start, const VisualInertialOptions& options,
                                  const ImuBuffer& imu, const std::optional<DepthSample>& depth) {
  const auto rest = imu.scatter(kRest_s);
  if (!rest || rest->gyro_sigma > options.zero_velocity_gyro_sigma ||
      rest->accel_sigma > options.zero_velocity_accel_sigma) {
    return std::nullopt;
  }
  const Vector3d up_B = rest->mean.accel_B;
  if (std::abs(up_B.norm() - options.gravity) > 0.1 * options.gravity) return std::nullopt;
  const Eigen::Quaterniond level = Eigen::Quaterniond::FromTwoVectors(up_B, Vector3d::UnitZ());
  ImuState state;
  state.motion.q_WB = (from_rpy(0.0, 0.0, start.yaw - to_rpy(level).z()) * level).normalized();
  state.motion.p_WB = start.position_W;
  state.gyro_bias = rest->mean.gyro_B;
  Sigmas sigmas{Vector3d::Constant(start.position_sigma_m),
                options.accel_bias_sigma / options.gravity,
                deg_to_rad(start.yaw_sigma_deg),
                kRestSpeedSigma,
                std::min(kRestGyroBiasSigma, options.gyro_bias_sigma),
                options.accel_bias_sigma};
  if (depth) take_depth(state, sigmas, options, *depth);
  return InitialState{imu.newest().utime, state, covariance(sigmas, state.motion.q_WB)};
}

std::optional<InitialState> begin(const KnownStart& start, const VisualInertialOptions& options,
                                  const ImuBuffer& imu, const std::optional<DepthSample>&) {
  if (imu.empty() || imu.newest().utime < start.utime) return std::nullopt;
  ImuState state;
  state.motion.q_WB = start.X_WB.q.normalized();
  state.motion.p_WB = start.X_WB.p;
  state.motion.v_WB = state.motion.q_WB * start.v_WB_B;
  state.gyro_bias = start.gyro_bias;
  state.accel_bias = start.accel_bias;
  const Sigmas sigmas{Vector3d::Constant(start.position_sigma_m),
                      deg_to_rad(start.tilt_sigma_deg),
                      deg_to_rad(start.yaw_sigma_deg),
                      start.speed_sigma,
                      options.gyro_bias_sigma,
                      options.accel_bias_sigma};
  return InitialState{start.utime, state, covariance(sigmas, state.motion.q_WB)};
}

bool is_sigma(double value) { return value > 0.0 && value < 1e4; }

std::string problem(const MotionStart& s) {
  if (!s.position_W.allFinite() || !s.v_WB_B.allFinite()) return "a start in motion is not finite";
  const bool holds = is_sigma(s.position_sigma_m) && is_sigma(s.speed_sigma) &&
                     is_sigma(s.tilt_sigma_deg) && is_sigma(s.heading_sigma_deg);
  return holds ? "" : "every sigma of a start in motion must be positive";
}

std::string problem(const RestStart& s) {
  if (!s.position_W.allFinite() || !std::isfinite(s.yaw)) return "a start at rest is not finite";
  const bool holds = is_sigma(s.position_sigma_m) && is_sigma(s.yaw_sigma_deg);
  return holds ? "" : "every sigma of a start at rest must be positive";
}

std::string problem(const KnownStart& s) {
  const bool is_finite = s.X_WB.is_finite() && s.v_WB_B.allFinite() && s.gyro_bias.allFinite() &&
                         s.accel_bias.allFinite() && std::abs(s.X_WB.q.norm() - 1.0) < 0.01;
  if (!is_finite) return "a known start is not finite, or its attitude is no unit quaternion";
  const bool holds = is_sigma(s.position_sigma_m) && is_sigma(s.tilt_sigma_deg) &&
                     is_sigma(s.yaw_sigma_deg) && is_sigma(s.speed_sigma);
  return holds ? "" : "every sigma of a known start must be positive";
}

}  // namespace

std::string validate(const FilterStart& start) {
  return std::visit([](const auto& s) { return problem(s); }, start);
}

std::optional<InitialState> begin(const FilterStart& start, const VisualInertialOptions& options,
                                  const ImuBuffer& imu, const std::optional<DepthSample>& depth) {
  return std::visit([&](const auto& s) { return begin(s, options, imu, depth); }, start);
}

}  // namespace dive::estimation
