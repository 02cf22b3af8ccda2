#pragma once
// Recordings in the ASL format, the format of EuRoC (Burri et al., "The EuRoC micro aerial vehicle
// datasets", 2016). Contents of a folder, with or without mav0/ in it:
//
//   cam0/ cam1/                     sensor.yaml (its models: camera_calibration.h),
//                                   data.csv: stamp [ns], file; data/*.png
//   imu0/                           sensor.yaml, data.csv: stamp, w (rad/s), a (m/s^2)
//   depth0/ (ours, optional)        data.csv: stamp, depth [m], positive down
//   state_groundtruth_estimate0/    data.csv: stamp, p, q (w x y z)[, v, ...]   (either, optional)
//   leica0/ vicon0/ mocap0/         data.csv: stamp, p[, q (w x y z)]; mocap0 is TUM-VI's
//
// B is the IMU's frame here: values in the files' own body frame are converted to it. Stamps become
// microseconds.

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
  struct Bias {
    Eigen::Vector3d gyro;   ///< rad/s
    Eigen::Vector3d accel;  ///< m/s^2
  };

  Utime utime = 0;
  Pose X_WB;                           ///< True pose; the attitude is identity if not measured.
  std::optional<Eigen::Vector3d> v_W;  ///< m/s
  std::optional<Bias> bias;            ///< Of the IMU.
};

struct AslDataset {
  std::vector<RecordedCamera> cameras;  ///< Left camera, or left and right.
  RecordedImuNoise imu_noise;
  double imu_rate_hz = 0.0;
  std::vector<ImuSample> imu;      ///< IMU samples by time; q_WB is identity: no attitude in ASL.
  std::vector<DepthSample> depth;  ///< Depth samples by time; empty without a depth sensor.
  std::vector<TruePose> truth;     ///< True poses by time; empty if there are none.
  bool has_true_attitude = false;
};

/// Reads everything but the images themselves. An error gives the file, the line, and what is
/// expected there.
[[nodiscard]] tl::expected<AslDataset, std::string> read_asl_dataset(const std::string& folder);

/// Reads only the sensors' sensor.yaml files; images, samples and truth may be absent. Errors as
/// above.
[[nodiscard]] tl::expected<AslDataset, std::string> read_asl_calibration(const std::string& folder);

/// Decodes an image to grey. `camera`: its index, for ImageFrame::camera.
[[nodiscard]] tl::expected<ImageFrame, std::string> read_image(const RecordedImage& image,
                                                               int camera);

}  // namespace dive::estimation
