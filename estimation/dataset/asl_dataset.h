#pragma once
// Recordings in the ASL format, the format of EuRoC (Burri et al., "The EuRoC micro aerial vehicle
// datasets", 2016). Contents of a folder, with or without mav0/ in it:
//
//   cam0/ cam1/                     sensor.yaml (its models: camera_calibration.h),
//                                   data.csv: stamp [ns], file; data/*.png
//   imu0/                           sensor.yaml, data.csv: stamp, w (rad/s), a (m/s^2)
//   depth0/ (ours, optional)        data.csv: stamp, depth [m], positive down
//   dvl0/ (ours, optional)          data.csv: stamp, velocity over ground in B [m/s]; sensor.yaml
//   speed0/ (ours, instead of it)   data.csv: stamp, speed along x of B [m/s]; sensor.yaml
//                                   sensor.yaml, optional: velocity_noise, one sigma [m/s]
//   state_groundtruth_estimate0/    data.csv: stamp, p, q (w x y z)[, v, ...]   (either, optional)
//   leica0/ vicon0/ mocap0/         data.csv: stamp, p[, q (w x y z)]; mocap0 is TUM-VI's
//
// B is the IMU's frame here: values in the files' own body frame are converted to it. Stamps become
// microseconds.

#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "estimation/dataset/recording.h"
#include "estimation/dataset/sensor_file.h"

namespace dive::estimation {

/// Reads everything but the images themselves. An error gives the file, the line, and what is
/// expected there. `sensors`: cameras and noise of the IMU from elsewhere, with the IMU as body
/// frame; the sensor.yaml files of cameras and IMU may be absent then.
[[nodiscard]] tl::expected<Recording, std::string> read_asl_dataset(
    const std::string& folder, std::optional<Recording> sensors = std::nullopt);

/// Reads a camera's model, and its pose in the file's body frame. `path`: the file's name.
[[nodiscard]] tl::expected<RecordedCamera, std::string> read_camera(const SensorFile& file,
                                                                    const std::string& path);
/// Reads noise and rate of the IMU into the recording; returns the IMU's pose in the file's body
/// frame.
[[nodiscard]] tl::expected<Pose, std::string> read_imu_sensor(const SensorFile& file,
                                                              Recording& recording);

/// True for such a folder whose IMU has no sensor.yaml.
[[nodiscard]] bool lacks_asl_calibration(const std::string& folder);

/// Reads only the sensors' sensor.yaml files; images, samples and truth may be absent. Errors as
/// above.
[[nodiscard]] tl::expected<Recording, std::string> read_asl_calibration(const std::string& folder);

}  // namespace dive::estimation
