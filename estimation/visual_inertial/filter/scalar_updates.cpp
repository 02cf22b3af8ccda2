#include "estimation/visual_inertial/filter/scalar_updates.h"

#include <array>

#include <Eigen/Cholesky>

#include "common/se3.h"
#include "estimation/visual_inertial/filter/feature_update.h"

namespace dive::estimation {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace imu_error;

ImuSystem depth_system(const FilterState& state, double depth_m, const Vector3d& sensor_B,
                       double sigma) {
  const Kinematics& now = state.imu.motion;
  ImuSystem system{MatrixXd::Zero(1, kSize), VectorXd(1), VectorXd::Constant(1, sigma * sigma)};
  system.r[0] = -depth_m - now.p_WB.z() - (now.q_WB * sensor_B).z();
  system.H.block<1, 3>(0, kAttitude) =
      -(state.imu.motion.q_WB.toRotationMatrix() * skew(sensor_B)).row(2);
  system.H(0, kPosition + 2) = 1.0;
  return system;
}

ImuSystem speed_system(const FilterState& state, const Vector3d& v_B, const Vector3d& sigma) {
  const Kinematics& now = state.imu.motion;
  ImuSystem system{MatrixXd::Zero(3, kSize), VectorXd(3), sigma.cwiseAbs2()};
  system.r = v_B - now.q_WB.conjugate() * now.v_WB;
  system.H.block<3, 3>(0, kAttitude) =
      skew(state.imu.motion.q_WB.conjugate() * state.imu.motion.v_WB);
  system.H.block<3, 3>(0, kVelocity) = state.imu.motion.q_WB.conjugate().toRotationMatrix();
  return system;
}

ImuSystem zero_velocity_system(const FilterState& state, const Vector3d& gyro_B, double speed_sigma,
                               double rate_sigma) {
  const ImuSystem speed = speed_system(state, Vector3d::Zero(), Vector3d::Constant(speed_sigma));
  ImuSystem system{MatrixXd::Zero(6, kSize), VectorXd(6), VectorXd(6)};
  system.H.topRows<3>() = speed.H;
  system.H.block<3, 3>(3, kGyroBias).setIdentity();
  system.r << speed.r, gyro_B - state.imu.gyro_bias;
  system.variances << speed.variances, Vector3d::Constant(rate_sigma * rate_sigma);
  return system;
}

UpdateResult gated_correct(FilterState& state, const ImuSystem& system, double gate_sigma) {
  const std::array<Columns, 1> columns{{{0, kSize}}};
  MatrixXd S = state.innovation(columns, system.H);
  S.diagonal() += system.variances;
  const Eigen::LLT<MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) return {UpdateStatus::kSingular, 0.0};
  const double distance = system.r.dot(llt.solve(system.r));
  const double ratio = distance / static_cast<double>(system.r.size());
  if (!(distance <= chi_square_limit(gate_sigma, system.r.size()))) {
    return {UpdateStatus::kGated, ratio};
  }
  const bool is_done = state.correct(columns, system.H, system.r, system.variances);
  return {is_done ? UpdateStatus::kAccepted : UpdateStatus::kSingular, ratio};
}

}  // namespace dive::estimation
