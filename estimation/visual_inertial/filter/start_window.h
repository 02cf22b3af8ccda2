#pragma once
// The images and IMU samples from which the filter is initialised: a second or two. Internal.

#include <cstddef>
#include <optional>
#include <vector>

#include "estimation/visual_inertial/filter/feature_tracks.h"
#include "estimation/visual_inertial/filter/imu_propagation.h"

namespace dive::estimation {

/// Frames by time, stamped by the IMU's clock; between each and the next the IMU's readings.
struct StartWindow {
  std::vector<Utime> utimes;
  std::vector<std::vector<ImuInterval>> imu;   ///< One less than frames.
  std::vector<Eigen::Vector3d> gyro_B;         ///< At each frame, rad/s.
  std::vector<std::optional<double>> depth_m;  ///< Of the depth sensor at each frame.
  std::vector<FeatureTrack> tracks;  ///< Their frames are indices; at least two observations.
  double sigma = 0.0;                ///< Noise of a ray, rad.

  [[nodiscard]] std::size_t size() const { return utimes.size(); }
};

}  // namespace dive::estimation
