#pragma once
// A recording in memory, whatever format it was read from: what the estimators need of it. Images
// are read when they are needed.
//
// B is the IMU's frame here. Stamps are microseconds.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "common/diagnostic.h"
#include "common/measurements.h"
#include "common/velocity_sample.h"

namespace dive::estimation {

struct RecordedImage {
  Utime utime = 0;
  std::string path;  ///< Path of a PNG file, or the image's place in a bag.
  /// Reads the image from a bag; empty for a PNG file. An error is a clause.
  std::function<tl::expected<ImageFrame, std::string>()> read = nullptr;
};

/// Where the samples of one sensor were read.
struct SampleOrigin {
  std::string file;                  ///< In a bag: "FILE /topic".
  std::vector<std::uint32_t> lines;  ///< Line, or message of the topic, of each sample, from 1.
  std::size_t refused = 0;           ///< Number of samples that were removed: sample_screen.h.

  /// A diagnostic at sample `index`; at the whole file if that sample has no line.
  [[nodiscard]] Diagnostic at(std::size_t index, Severity severity, std::string code,
                              std::string message, std::string hint) const;
  /// A diagnostic of the whole file.
  [[nodiscard]] Diagnostic of_all(Severity severity, std::string code, std::string message,
                                  std::string hint) const;
};

struct RecordedCamera {
  CameraModel model;  ///< Camera model with X_BC in the IMU's frame.
  /// One sigma of what the calibration states; empty where not given.
  std::optional<double> focal_sigma;             ///< Of the focal lengths, as a share.
  std::optional<double> centre_sigma_px;         ///< Of the principal point.
  std::optional<double> refractive_index_sigma;  ///< Before a flat port.
  double rate_hz = 0.0;
  double time_shift_s = 0.0;  ///< The images' stamps contain it: IMU time minus camera time.
  std::vector<RecordedImage> images;  ///< Images by time.
  SampleOrigin images_origin;
  std::string calibration_file;
  int resolution_line = 0;  ///< Line of its resolution there, from 1; 0 if unknown.
};

/// Sigma of a measured velocity, m/s per axis, where none is stated.
inline constexpr double kDvlSigma = 0.02;

/// Noise of the IMU by its data sheet or sensor.yaml; empty where not given.
struct RecordedImuNoise {
  std::optional<double> gyro;           ///< rad/s/sqrt(Hz)
  std::optional<double> accel;          ///< m/s^2/sqrt(Hz)
  std::optional<double> gyro_walk;      ///< rad/s^2/sqrt(Hz)
  std::optional<double> accel_walk;     ///< m/s^3/sqrt(Hz)
  std::optional<double> gyro_bias;      ///< Turn-on bias, one sigma, rad/s
  std::optional<double> accel_bias;     ///< Turn-on bias, one sigma, m/s^2
  std::optional<double> scale;          ///< Relative error of scale and misalignment
  std::optional<double> gyro_by_accel;  ///< g-sensitivity, rad/s per m/s^2
  double gyro_range = 34.9;    ///< rad/s: at or beyond it the gyro is saturated; 2000 deg/s
  double accel_range = 157.0;  ///< m/s^2, of the accelerometer; 16 g
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

struct Recording {
  std::vector<RecordedCamera> cameras;  ///< Left camera, or left and right.
  RecordedImuNoise imu_noise;
  double imu_rate_hz = 0.0;
  std::vector<ImuSample>
      imu;  ///< IMU samples by time; q_WB is identity: recordings have no attitude.
  std::vector<DepthSample> depth;  ///< Depth samples by time; empty without a depth sensor.
  double depth_sigma_m = 0.02;     ///< Their noise.
  Eigen::Vector3d depth_sensor_B = Eigen::Vector3d::Zero();  ///< Position of that sensor, m.
  std::vector<VelocitySample> velocity;  ///< Velocity samples by time; empty without a DVL.
  std::vector<TruePose> truth;           ///< True poses by time; empty if there are none.
  bool has_true_attitude = false;

  std::string source;  ///< File or folder that it was read from.
  SampleOrigin imu_origin;
  SampleOrigin depth_origin;
  SampleOrigin velocity_origin;
  SampleOrigin truth_origin;
  Diagnostics diagnostics;  ///< What is wrong with the recording, as far as it was noticed.
};

/// The image taken within a millisecond of `utime`, if there is one: the other of a stereo pair.
[[nodiscard]] const RecordedImage* image_at(const std::vector<RecordedImage>& images, Utime utime);

/// Decodes an image to grey. An error begins with its path. `camera`: its index, for
/// ImageFrame::camera.
[[nodiscard]] tl::expected<ImageFrame, std::string> read_image(const RecordedImage& image,
                                                               int camera);

}  // namespace dive::estimation
