#pragma once
// Whether an estimator can run on a recording, found before it does.

#include "estimation/dataset/dataset_run.h"
#include "estimation/dataset/recording.h"

namespace dive::estimation {

/// Adds diagnostics to the recording: errors where `options` cannot give an estimate from it or
/// where the estimator's contracts would be violated, warnings where the estimate will be worse
/// than it could be. Errors: image sizes, cameras that are no stereo pair, too low a rate of the
/// IMU, sensors whose times do not overlap, an initial state that the recording lacks. Truth
/// without an image in its time is removed, with a warning. Decodes one image of each camera used.
void check_recording(Recording& recording, const RunOptions& options);

}  // namespace dive::estimation
