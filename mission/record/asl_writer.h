#pragma once
// A dataset in the ASL format of the EuRoC data (Burri et al. 2016, "The EuRoC micro aerial vehicle
// datasets", IJRR 35(10)), so that programs for EuRoC read ours:
//
//    DIR/mav0/cam0, cam1                    data/NANOSECONDS.png, data.csv, sensor.yaml
//   DIR/mav0/imu0                          data.csv: gyro (rad/s), specific force (m/s^2)
//   DIR/mav0/depth0                        data.csv: depth below the surface (m), positive down
//   DIR/mav0/state_groundtruth_estimate0   data.csv: p, q (w x y z), v in W, both biases
//
// Times are in nanoseconds. The body frame is B, which is also the frame of the IMU; T_BS is the
// pose of a sensor in B. W has z up. depth0 is ours: EuRoC has no pressure sensor; its data.csv has
// the columns "#timestamp [ns],depth [m]", its sensor.yaml the standard deviation noise_sigma (m);
// it contains the depth of B's origin, wherever the sensor is mounted.

#include <array>
#include <memory>
#include <string>

#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "common/output_file.h"
#include "common/se3.h"
#include "vehicle/simulator/sensors/inertial_unit.h"

namespace dive::mission {

/// Values of the sensor.yaml files.
struct AslSensors {
  std::array<CameraModel, 2> cameras;
  double camera_rate_hz = 20.0;
  double imu_rate_hz = 200.0;
  vehicle::ImuNoise imu;
  double depth_rate_hz = 50.0;
  double depth_sigma_m = 0.0;
  std::string comment;  ///< One line: the source of the recording.
};

/// Writes only DIR/cam0, cam1 and imu0, each with its sensor.yaml: the input of `dive run
/// --cameras`.
[[nodiscard]] tl::expected<void, OutputError> write_asl_calibration(const std::string& folder,
                                                                    const AslSensors& sensors,
                                                                    Existing existing);

/// One row of the ground truth.
struct AslTruth {
  Utime utime = 0;
  Pose X_WB;
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_B = Eigen::Vector3d::Zero();
};

class AslWriter {
 public:
  /// Creates the folders and the sensor.yaml files. A dataset that the folder already holds is
  /// removed if it may be replaced, and no file of it is an input.
  [[nodiscard]] static tl::expected<AslWriter, OutputError> create(const std::string& folder,
                                                                   const AslSensors& sensors,
                                                                   Existing existing);
  AslWriter(AslWriter&&) noexcept;
  AslWriter& operator=(AslWriter&&) noexcept;
  ~AslWriter();

  /// Rows are written in the order of the calls. Grey images of camera 0 or 1.
  void write(const ImageFrame& frame);
  void write(const ImuSample& sample);
  void write(const DepthSample& sample);
  void write(const AslTruth& truth);
  /// Nothing can be written afterwards. The error names the incomplete part.
  [[nodiscard]] tl::expected<void, OutputError> close();

 private:
  struct Impl;
  explicit AslWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::mission
