#pragma once
// Times between the samples of a recording. Internal.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/clock.h"

namespace dive::estimation {

/// Median time between samples by time, s; 0 for fewer than two.
template <typename Sample>
[[nodiscard]] double median_step(const std::vector<Sample>& samples) {
  if (samples.size() < 2) return 0.0;
  std::vector<Utime> steps;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps.push_back(samples[i].utime - samples[i - 1].utime);
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return to_seconds(*middle);
}

}  // namespace dive::estimation
