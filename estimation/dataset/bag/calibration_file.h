#pragma once
// Calibrations that are given apart from a recording.

#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "estimation/dataset/recording.h"

namespace dive::estimation {

struct Calibration {
  Recording sensors;  ///< Cameras and noise of the IMU; nothing else.
  /// One for each camera: its topic in the recording it was calibrated with (may be empty), and its
  /// stamp's delay, s: IMU time = image time + shift.
  std::vector<std::string> topics;
  std::vector<double> shifts_s;
};

/// Reads, together: folders in the ASL format (sensor.yaml of each sensor; nothing else is needed),
/// and YAML files: a chain of cameras and one of an IMU by Kalibr, a camera's sensor.yaml, an
/// IMU's. Cameras are in the order given. Errors as of SensorFile; no camera at all is one.
[[nodiscard]] tl::expected<Calibration, std::string> read_calibration(
    const std::vector<std::string>& paths);

}  // namespace dive::estimation
