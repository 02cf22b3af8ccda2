#pragma once
// The most likely motion over a window of images (maximum a posteriori, Levenberg-Marquardt): the
// poses and velocities of its frames, the IMU's biases, and the points seen, given
//
//   - the IMU between frames, propagated as in the filter;
//   - each point's images, in inverse depth from the first frame that sees it (Montiel, Civera,
//     Davison 2006), so that a point without parallax is no special case;
//   - depth, and priors of the first position, of the heading, of the biases, of the speed, of the
//     cameras' poses and of their clock.
//
// The points are eliminated (Schur complement); the covariance is the inverse of what remains.
// Huber's weights (1964) limit the effect of points that move. Internal.

#include <optional>

#include "common/se3.h"
#include "estimation/visual_inertial/filter/start_window.h"

namespace dive::estimation {

struct WindowPriors {
  Eigen::Vector3d position_sigma_m{0.1, 0.1, 0.1};  ///< Of the first frame.
  double heading_sigma = 0.02;  ///< rad, about the vertical, of the first frame.
  ImuState bias;                ///< Only the biases.
  double gyro_bias_sigma = 0.1;
  double accel_bias_sigma = 0.2;
  struct Speed {
    Eigen::Vector3d v_B = Eigen::Vector3d::Zero();
    double sigma = 0.1;     ///< m/s, per axis.
    std::size_t frame = 0;  ///< The frame at which the vehicle had it.
  };
  std::optional<Speed> speed;
  std::optional<double> rest_sigma;  ///< m/s per axis, if it is at rest in all frames.
};

struct WindowFit {
  ImuState last;          ///< At the last frame.
  Matrix15d covariance;   ///< Of `last`, in the order of imu_error.
  double total = 0.0;     ///< Of all terms, in sigmas squared: compares fits of one window.
  double cost = 0.0;      ///< Squared image residual per degree of freedom: 1 on average.
  double outliers = 0.0;  ///< Share of the image residuals beyond three sigma.
  double behind = 0.0;    ///< Share of the points behind their camera.
};

/// `first`: pose, velocity and biases of the first frame to begin with; its position and heading
/// are the priors' means. Empty if it does not converge.
[[nodiscard]] std::optional<WindowFit> fit_window(const StartWindow& window,
                                                  const VisualInertialOptions& options,
                                                  const std::vector<Pose>& cameras_B,
                                                  const ImuState& first,
                                                  const WindowPriors& priors);

}  // namespace dive::estimation
