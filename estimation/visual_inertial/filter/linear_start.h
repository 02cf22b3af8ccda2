#pragma once
// Velocity and gravity at the start of a window by linear least squares (Dong-Si and Mourikis,
// "Estimator initialization in vision-aided inertial navigation with unknown camera-IMU
// calibration", IROS 2012). In the body frame B0 of the first frame, with the double integral a_k
// of the specific force and the rotation R_k by the gyro, the camera of frame k is at
//
//   c_k = v t_k + g t_k^2 / 2 + a_k + R_k p_BC
//
// and a point f on the ray d of its image obeys (I - d d^T)(f - c_k) = 0: linear in f, v and g. The
// points are eliminated one by one. Internal.

#include "common/se3.h"
#include "estimation/visual_inertial/filter/start_window.h"

namespace dive::estimation {

struct LinearPrior {
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();  ///< m/s, in B0.
  double speed_sigma = 1.5;                       ///< m/s, per axis.
};

struct LinearStart {
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();  ///< m/s, in B0.
  Eigen::Vector3d g_B = Eigen::Vector3d::Zero();  ///< Gravity, in B0, not normalised, m/s^2.
};

/// `cameras_B`: left, or left and right. Gravity has a prior too: the mean of the accelerometer.
[[nodiscard]] LinearStart solve_linear_start(const StartWindow& window,
                                             const std::vector<Pose>& cameras_B,
                                             const Eigen::Vector3d& gyro_bias,
                                             const LinearPrior& prior);

}  // namespace dive::estimation
