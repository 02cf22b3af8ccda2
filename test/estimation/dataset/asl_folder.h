#pragma once
// Writes small recordings in the ASL format, from its published description only.

#include <string>

#include "common/camera_model.h"
#include "common/measurements.h"

namespace dive::estimation::testing {

/// An empty folder for this test only.
[[nodiscard]] std::string fresh_folder();

/// Creates missing folders.
void write_text(const std::string& path, const std::string& text);
void write_png(const std::string& path, const ImageFrame& image);

/// EuRoC's own file for its left camera, with the values of `camera`.
[[nodiscard]] std::string camera_yaml(const CameraModel& camera);
[[nodiscard]] std::string imu_yaml();

}  // namespace dive::estimation::testing
