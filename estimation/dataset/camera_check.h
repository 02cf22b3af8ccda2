#pragma once
// Whether the visual-inertial estimator can use a recording's cameras.

#include <cstddef>

#include "estimation/dataset/recording.h"

namespace dive::estimation {

/// Adds diagnostics about the first `most` cameras to the recording: errors about images too small
/// or of another size than calibrated, or not readable at all, and about two cameras that are no
/// stereo pair; a warning about left images without a right one. Decodes each camera's images until
/// one is readable.
void check_cameras(Recording& recording, std::size_t most);

}  // namespace dive::estimation
