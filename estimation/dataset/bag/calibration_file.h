#pragma once
// Calibrations that are given apart from a recording.

#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "estimation/dataset/recording.h"

namespace dive::estimation {

/// The sensors' topics in the recording that they were calibrated with; each may be empty.
struct CalibratedTopics {
  std::string imu;
  std::vector<std::string> cameras;
};

struct Calibration {
  Recording sensors;  ///< Cameras and noise of the IMU, and notes on them; nothing else.
  CalibratedTopics topics;
};

/// Reads, together: folders in the ASL format (sensor.yaml of each sensor; nothing else is needed),
/// and YAML files: a chain of cameras and one of an IMU by Kalibr, a camera's sensor.yaml, an
/// IMU's. Cameras are in the order given; those whose pose is T_BS in the body frame of the IMU's
/// file are converted to the IMU's frame. Errors as of SensorFile; no camera at all is one.
[[nodiscard]] tl::expected<Calibration, std::string> read_calibration(
    const std::vector<std::string>& paths);

/// Kalibr's files that TUM-VI's exported folders have beside mav0, as dso/camchain.yaml and
/// dso/imu_config.yaml; empty if they are not there. `recording`: that folder, or mav0 in it.
[[nodiscard]] std::vector<std::string> calibration_beside(const std::string& recording);

}  // namespace dive::estimation
