#pragma once
// Recordings in the ASL format, as EuRoC's come in (Burri et al., "The EuRoC micro aerial vehicle
// datasets", 2016). Of a folder, with or without mav0/ in it:
//
//   cam0/ cam1/                     sensor.yaml, data.csv: stamp [ns], file; data/*.png
//   imu0/                           sensor.yaml, data.csv: stamp, w (rad/s), a (m/s^2)
//   depth0/ (ours, optional)        data.csv: stamp, depth [m], positive down
//   state_groundtruth_estimate0/    data.csv: stamp, p, q (w x y z)[, v, ...]   (either, optional)
//   leica0/ vicon0/                 data.csv: stamp, p[, q (w x y z)]
//
// B is the IMU's frame here: what the files say of their own body frame is turned into that. Stamps
// become microseconds.

#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "common/measurements.h"

namespace dive::estimation {

struct RecordedPicture {
  Utime utime = 0;
  std::string path;  ///< Of a PNG file.
};

struct RecordedCamera {
  CameraModel model;  ///< X_BC in the IMU's frame.
  double rate_hz = 0.0;
  std::vector<RecordedPicture> pictures;  ///< By time.
};

/// As the data sheet, or sensor.yaml, has it; nothing where it says nothing.
struct RecordedImuNoise {
  std::optional<double> gyro;        ///< rad/s/sqrt(Hz)
  std::optional<double> accel;       ///< m/s^2/sqrt(Hz)
  std::optional<double> gyro_walk;   ///< rad/s^2/sqrt(Hz)
  std::optional<double> accel_walk;  ///< m/s^3/sqrt(Hz)
};

struct TruePose {
  Utime utime = 0;
  Pose X_WB;                           ///< Attitude: identity where it was not measured.
  std::optional<Eigen::Vector3d> v_W;  ///< m/s
};

struct AslDataset {
  std::vector<RecordedCamera> cameras;  ///< Left, or left and right.
  RecordedImuNoise imu_noise;
  double imu_rate_hz = 0.0;
  std::vector<ImuSample> imu;      ///< By time; q_WB stays identity: the format has no attitude.
  std::vector<DepthSample> depth;  ///< By time; empty without a depth sensor.
  std::vector<TruePose> truth;     ///< By time; empty without any.
  bool has_true_attitude = false;
};

/// Everything but the pictures themselves. An error says which file, which line, and what is
/// expected there.
[[nodiscard]] tl::expected<AslDataset, std::string> read_asl_dataset(const std::string& folder);

/// Only what the sensors' files sensor.yaml say: no pictures, samples or truth, of which there need
/// be none. Errors likewise.
[[nodiscard]] tl::expected<AslDataset, std::string> read_asl_calibration(const std::string& folder);

/// Decodes a picture to grey. `camera`: its index, for ImageFrame::camera.
[[nodiscard]] tl::expected<ImageFrame, std::string> read_picture(const RecordedPicture& picture,
                                                                 int camera);

}  // namespace dive::estimation
