#pragma once
// The images and IMU samples from which the filter is initialised: a second or two. Internal.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimation/visual_inertial/filter/imu_propagation.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"

namespace dive::estimation {

/// One feature in the frames of a window.
struct WindowTrack {
  struct View {
    std::size_t frame = 0;
    Eigen::Vector2d left = Eigen::Vector2d::Zero();
    std::optional<Eigen::Vector2d> right;
    /// From a difference of image coordinates to sigmas of a pixel, for left and right.
    std::array<Eigen::Matrix2d, 2> whitening{Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero()};
  };
  std::int64_t id = 0;
  std::vector<View> views;  ///< By frame, at least two.
};

/// Frames by time, stamped by the IMU's clock; between each and the next the IMU's readings.
struct StartWindow {
  std::vector<Utime> utimes;
  std::vector<std::vector<ImuInterval>> imu;   ///< One less than frames.
  std::vector<Eigen::Vector3d> gyro_B;         ///< At each frame, rad/s.
  std::vector<std::optional<double>> depth_m;  ///< Of the depth sensor at each frame.
  std::vector<WindowTrack> tracks;
  double sigma = 0.0;  ///< Noise of a ray, rad.

  [[nodiscard]] std::size_t size() const { return utimes.size(); }
};

/// The motion over `imu` from `begin`, with its transition and noise.
[[nodiscard]] ImuStep propagate_over(const ImuState& begin, const std::vector<ImuInterval>& imu,
                                     const ImuNoise& noise, double gravity);

}  // namespace dive::estimation
