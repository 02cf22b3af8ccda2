#pragma once
// Whether an estimator can run on a recording, found before it does.

#include <cstddef>
#include <vector>

#include "estimation/dataset/dataset_run.h"
#include "estimation/dataset/recording.h"

namespace dive::estimation {

/// What is missing or saturated in the samples of an IMU, by the limits of the visual-inertial
/// estimator.
struct ImuSummary {
  std::size_t gaps = 0;       ///< Steps of more than 0.05 s.
  std::size_t first_gap = 0;  ///< Index of the sample at the end of the first one.
  double longest_gap_s = 0.0;
  std::size_t saturated = 0;
  std::size_t first_saturated = 0;  ///< Its index.
};
[[nodiscard]] ImuSummary summary_of(const Recording& recording);

/// Adds diagnostics to the recording: errors where `options` cannot give an estimate from it or
/// where the estimator's contracts would be violated, warnings where the estimate will be worse
/// than it could be. Errors: image sizes, cameras that are no stereo pair, too low a rate of the
/// IMU or a rate that no IMU has, sensors without samples or whose times do not overlap, an initial
/// state that the recording lacks. Depth, velocity and truth without an image in their time are
/// removed, with a warning. Decodes each used camera's images until one is readable.
void check_recording(Recording& recording, const RunOptions& options);

}  // namespace dive::estimation
