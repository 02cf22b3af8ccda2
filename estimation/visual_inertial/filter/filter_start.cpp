#include "estimation/visual_inertial/filter/filter_start.h"

#include <cmath>

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Sigmas {
  Vector3d position;  // per axis of W
  double tilt;
  double yaw;
  double speed;
  double gyro_bias;
  double accel_bias;
};

// Tilt and yaw are about the axes of W, the error of the attitude is expressed in B. The velocity
// is known in B: in W it errs with the attitude, by -R [v_B]x theta.
Matrix15d covariance(const Sigmas& s, const Kinematics& motion) {
  using namespace imu_error;
  Matrix15d P = Matrix15d::Zero();
  const Matrix3d R_WB = motion.q_WB.toRotationMatrix();
  const Vector3d attitude(s.tilt * s.tilt, s.tilt * s.tilt, s.yaw * s.yaw);
  P.block<3, 3>(kAttitude, kAttitude) = R_WB.transpose() * attitude.asDiagonal() * R_WB;
  P.diagonal().segment<3>(kPosition) = s.position.cwiseAbs2();
  const Matrix3d by_attitude = -skew(motion.v_WB) * R_WB;
  const Matrix3d cross = by_attitude * P.block<3, 3>(kAttitude, kAttitude);
  P.block<3, 3>(kVelocity, kAttitude) = cross;
  P.block<3, 3>(kAttitude, kVelocity) = cross.transpose();
  P.block<3, 3>(kVelocity, kVelocity) = cross * by_attitude.transpose();
  P.diagonal().segment<3>(kVelocity).array() += s.speed * s.speed;
  P.diagonal().segment<3>(kGyroBias).setConstant(s.gyro_bias * s.gyro_bias);
  P.diagonal().segment<3>(kAccelBias).setConstant(s.accel_bias * s.accel_bias);
  return 0.5 * (P + P.transpose());
}

bool is_sigma(double value) { return value > 0.0 && value < 1e4; }

std::string problem(const BiasPrior& b) {
  if (!b.gyro.allFinite() || !b.accel.allFinite()) return "the biases to begin with are not finite";
  const bool holds = is_sigma(b.gyro_sigma.value_or(1.0)) && is_sigma(b.accel_sigma.value_or(1.0));
  return holds ? "" : "every sigma of a bias to begin with must be positive";
}

std::string problem(const ImageStart& s) {
  const bool is_finite =
      s.position_W.allFinite() && s.heading.coeffs().allFinite() && s.heading.norm() > 0.5;
  if (!is_finite) return "a start from images is not finite";
  if (s.speed && !s.speed->v_WB_B.allFinite()) return "a start's speed is not finite";
  const bool holds = is_sigma(s.position_sigma_m) && is_sigma(s.heading_sigma_deg) &&
                     (!s.speed || is_sigma(s.speed->sigma));
  return holds ? problem(s.bias) : "every sigma of a start from images must be positive";
}

std::string problem(const KnownStart& s) {
  const bool is_finite =
      s.X_WB.is_finite() && s.v_WB_B.allFinite() && std::abs(s.X_WB.q.norm() - 1.0) < 0.01;
  if (!is_finite) return "a known start is not finite, or its attitude is no unit quaternion";
  const bool holds = is_sigma(s.position_sigma_m) && is_sigma(s.tilt_sigma_deg) &&
                     is_sigma(s.yaw_sigma_deg) && is_sigma(s.speed_sigma);
  return holds ? problem(s.bias) : "every sigma of a known start must be positive";
}

}  // namespace

std::string validate(const FilterStart& start) {
  return std::visit([](const auto& s) { return problem(s); }, start);
}

std::optional<InitialState> begin(const KnownStart& start, const VisualInertialOptions& options,
                                  const ImuBuffer& imu) {
  if (imu.empty() || imu.newest().utime < start.utime) return std::nullopt;
  ImuState state;
  state.motion.q_WB = start.X_WB.q.normalized();
  state.motion.p_WB = start.X_WB.p;
  state.motion.v_WB = state.motion.q_WB * start.v_WB_B;
  state.gyro_bias = start.bias.gyro;
  state.accel_bias = start.bias.accel;
  // The height in the state is that by the depth sensor.
  const double height_sigma = std::hypot(start.position_sigma_m, options.depth_bias_sigma_m);
  const Sigmas sigmas{{start.position_sigma_m, start.position_sigma_m, height_sigma},
                      deg_to_rad(start.tilt_sigma_deg),
                      deg_to_rad(start.yaw_sigma_deg),
                      start.speed_sigma,
                      start.bias.gyro_sigma.value_or(options.gyro_bias_sigma),
                      start.bias.accel_sigma.value_or(options.accel_bias_sigma)};
  return InitialState{start.utime, state, covariance(sigmas, state.motion), std::nullopt, true};
}

}  // namespace dive::estimation
