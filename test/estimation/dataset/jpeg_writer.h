#pragma once
// Writes JPEG data by libjpeg.

#include <string>

#include "common/measurements.h"

namespace dive::estimation::testing {

/// `restart_interval`: blocks of 8 x 8 pixels between two markers; 0: no markers.
[[nodiscard]] std::string jpeg_of(const ImageFrame& frame, unsigned restart_interval = 0);

}  // namespace dive::estimation::testing
