#pragma once
// A recording in memory, whatever format it was read from: what the estimators need of it. Images
// are read when they are needed.
//
// B is the IMU's frame here. Stamps are microseconds.

#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "common/measurements.h"

namespace dive::estimation {

struct RecordedImage {
  Utime utime = 0;
  std::string path;  ///< Path of a PNG file.
};

struct RecordedCamera {
  CameraModel model;  ///< Camera model with X_BC in the IMU's frame.
  double rate_hz = 0.0;
  std::vector<RecordedImage> images;  ///< Images by time.
};

/// Noise of the IMU by its data sheet or sensor.yaml; empty where not given.
struct RecordedImuNoise {
  std::optional<double> gyro;        ///< rad/s/sqrt(Hz)
  std::optional<double> accel;       ///< m/s^2/sqrt(Hz)
  std::optional<double> gyro_walk;   ///< rad/s^2/sqrt(Hz)
  std::optional<double> accel_walk;  ///< m/s^3/sqrt(Hz)
};

struct TruePose {
  Utime utime = 0;
  Pose X_WB;                           ///< True pose; the attitude is identity if not measured.
  std::optional<Eigen::Vector3d> v_W;  ///< m/s
};

struct Recording {
  std::vector<RecordedCamera> cameras;  ///< Left camera, or left and right.
  RecordedImuNoise imu_noise;
  double imu_rate_hz = 0.0;
  std::vector<ImuSample>
      imu;  ///< IMU samples by time; q_WB is identity: recordings have no attitude.
  std::vector<DepthSample> depth;  ///< Depth samples by time; empty without a depth sensor.
  std::vector<TruePose> truth;     ///< True poses by time; empty if there are none.
  bool has_true_attitude = false;
};

/// Decodes an image to grey. `camera`: its index, for ImageFrame::camera.
[[nodiscard]] tl::expected<ImageFrame, std::string> read_image(const RecordedImage& image,
                                                               int camera);

}  // namespace dive::estimation
