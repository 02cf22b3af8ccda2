#pragma once
// Writes small recordings in the ASL format, as a person would who has only read its description.

#include <string>

#include "common/camera_model.h"
#include "common/measurements.h"

namespace dive::estimation::testing {

/// An empty folder of this test's own.
[[nodiscard]] std::string fresh_folder();

/// Makes folders on the way.
void write_text(const std::string& path, const std::string& text);
void write_png(const std::string& path, const ImageFrame& picture);

/// EuRoC's own file for its left camera, but for what is put in.
[[nodiscard]] std::string camera_yaml(const CameraModel& camera);
[[nodiscard]] std::string imu_yaml();

}  // namespace dive::estimation::testing
