#pragma once
// How the filter is initialised: from images (image_start.h), or at a given state.

#include <optional>
#include <variant>

#include "common/measurements.h"
#include "estimation/visual_inertial/filter/filter_state.h"
#include "estimation/visual_inertial/filter/imu_buffer.h"

namespace dive::estimation {

/// What is known of the IMU's biases beforehand. Without sigmas they are those of turn-on biases in
/// VisualInertialOptions; a restart knows more.
struct BiasPrior {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< m/s^2
  std::optional<double> gyro_sigma;
  std::optional<double> accel_sigma;
};

/// Initialisation from half a second to two seconds of images and IMU samples, at rest or in
/// motion.
struct ImageStart {
  struct Speed {
    Eigen::Vector3d v_WB_B = Eigen::Vector3d::Zero();  ///< m/s
    double sigma = 0.1;                                ///< m/s, per axis.
    /// When it was measured; without it the vehicle is expected to have this speed at any time.
    std::optional<Utime> utime;
  };
  /// When the vehicle had this position and heading; without it at the first image.
  std::optional<Utime> utime;
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();  ///< m; z is taken from depth if there is.
  double position_sigma_m = 0.1;
  /// Attitude of that heading: the filter's is turned about the vertical to come nearest to it.
  Eigen::Quaterniond heading = Eigen::Quaterniond::Identity();
  double heading_sigma_deg = 1.0;
  std::optional<Speed> speed;  ///< Without it one camera needs a change of speed.
  BiasPrior bias;
};

/// Initialisation at a given state and time.
struct KnownStart {
  Utime utime = 0;
  Pose X_WB;
  Eigen::Vector3d v_WB_B = Eigen::Vector3d::Zero();
  BiasPrior bias;
  double position_sigma_m = 0.01;
  double tilt_sigma_deg = 0.2;
  double yaw_sigma_deg = 0.2;
  double speed_sigma = 0.02;
};

using FilterStart = std::variant<ImageStart, KnownStart>;

/// Empty if usable, else a sentence.
[[nodiscard]] std::string validate(const FilterStart& start);

struct InitialState {
  Utime utime = 0;
  ImuState state;
  Matrix15d covariance;
  /// Mean rate and specific force, if the biases were found there (FilterState::correlate_biases).
  std::optional<ImuReading> biases_at;
  /// False: without a depth sample, the height is that of nothing in particular.
  bool has_height = true;
};

/// Empty until the IMU has reached its time.
[[nodiscard]] std::optional<InitialState> begin(const KnownStart& start,
                                                const VisualInertialOptions& options,
                                                const ImuBuffer& imu);

}  // namespace dive::estimation
