#pragma once
// A dive in closed form, for the filter's tests: an oval of 115 m among random points, with depth
// and roll, observed by a stereo pair; and its sensors' samples. Shares no code with the filter.

#include <cstdint>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "common/random.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"
#include "test/estimation/visual_inertial/filter/made_features.h"

namespace dive::testing {

struct AnalyticDiveOptions {
  double speed = 0.4;  ///< Mean speed over the oval, m/s; 0 is at rest.
  bool is_stereo = true;
  /// Pinhole, or an ideal equidistant lens with the same field of view: 115 x 90 degrees.
  LensModel lens = LensModel::kPinhole;
  double imu_hz = 200.0;
  double frame_hz = 20.0;
  double depth_hz = 10.0;
  double pixel_sigma = 0.7;
  double depth_sigma_m = 0.02;
  double depth_bias_sigma_m = 0.03;   ///< Constant error of depth; drawn once.
  double gyro_noise = 1.7e-4;         ///< rad/s/sqrt(Hz), an ADIS16448 as EuRoC states it
  double accel_noise = 2.0e-3;        ///< m/s^2/sqrt(Hz)
  double gyro_walk = 2.0e-5;          ///< rad/s^2/sqrt(Hz)
  double accel_walk = 1.0e-3;         ///< m/s^3/sqrt(Hz)
  double gyro_bias_sigma = 0.05;      ///< rad/s, turn-on: MEMS units have 0.02 to 0.1
  double accel_bias_sigma = 0.15;     ///< m/s^2, turn-on: 0.05 to 0.3
  double imu_scale_sigma = 0.005;     ///< Scale and misalignment, per element.
  double gyro_by_accel_sigma = 3e-5;  ///< rad/s per m/s^2; an ADIS16448 has 0.015 deg/s/g
  double extrinsic_sigma_deg = 0.3;   ///< Error of the configured camera rotation.
  double extrinsic_sigma_m = 0.005;   ///< Error of the configured camera position.
  double time_offset_sigma_s = 0.003;
  double focal_sigma = 0.0;             ///< Error of the configured focal lengths, as a share.
  double centre_sigma_px = 0.0;         ///< Error of the configured principal points.
  double refractive_index = 1.0;        ///< Configured, before a flat port; 1: no port.
  double refractive_index_sigma = 0.0;  ///< Its error.
  double line_time_s = 0.0;             ///< Of a rolling shutter.
  int features = 200;                   ///< Features tracked at a time.
  double snow_share = 0.0;              ///< Fraction of them that drift through the water.
  double loss_share = 0.01;             ///< Fraction of the tracks lost from one frame to the next.
  double unit_tilt_deg = 0.3;           ///< One sigma of the AHRS attitude; drawn once.
  double unit_heading_deg = 1.5;
};

struct DiveTruth {
  Pose X_WB;
  Eigen::Vector3d v_WB_B;
  Eigen::Vector3d omega_WB_B;
  Eigen::Vector3d acceleration_W;
};

class AnalyticDive {
 public:
  AnalyticDive(AnalyticDiveOptions options, std::uint64_t seed);
  AnalyticDive(const AnalyticDive&) = delete;  // features_ refers to random_
  AnalyticDive& operator=(const AnalyticDive&) = delete;

  [[nodiscard]] DiveTruth truth(double t) const;
  /// Next samples, in order; t in s by the IMU's clock.
  [[nodiscard]] ImuSample imu(Utime utime);
  [[nodiscard]] DepthSample depth(Utime utime);
  /// The image taken at `utime` by the IMU's clock; its stamp is by the cameras' clock.
  [[nodiscard]] estimation::FeatureFrame frame(Utime utime);

  /// Cameras as configured in the filter.
  [[nodiscard]] const std::vector<CameraModel>& cameras() const { return nominal_cameras_; }
  [[nodiscard]] const std::vector<CameraModel>& true_cameras() const { return true_; }
  [[nodiscard]] double true_time_offset_s() const { return time_offset_s_; }
  [[nodiscard]] const Eigen::Vector3d& gyro_bias() const { return gyro_bias_; }
  [[nodiscard]] const Eigen::Vector3d& accel_bias() const { return accel_bias_; }
  [[nodiscard]] const Eigen::Matrix3d& gyro_scale() const { return gyro_scale_; }
  /// True if a feature's id belongs to a moving object.
  [[nodiscard]] static bool is_snow(std::int64_t id) { return MadeFeatures::is_snow(id); }
  [[nodiscard]] Eigen::Vector3d landmark(std::int64_t id) const { return features_->landmark(id); }

 private:
  [[nodiscard]] Eigen::Vector3d normal3(double sigma);

  AnalyticDiveOptions options_;
  Random random_;
  std::vector<CameraModel> nominal_cameras_;
  std::vector<CameraModel> true_;
  double time_offset_s_;
  double depth_bias_m_ = 0.0;
  Eigen::Vector3d gyro_bias_;
  Eigen::Vector3d accel_bias_;
  Eigen::Matrix3d gyro_scale_;   ///< Scale and misalignment.
  Eigen::Matrix3d accel_scale_;  ///< Scale and misalignment.
  Eigen::Matrix3d gyro_by_accel_;
  Eigen::Quaterniond unit_error_;
  std::optional<MadeFeatures> features_;
};

}  // namespace dive::testing
