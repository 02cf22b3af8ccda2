#pragma once
// Order statistics of measurements.

#include <algorithm>
#include <cstddef>
#include <vector>

namespace dive::bench {

/// The value of the nearest rank: 0 the least, 0.5 the median, 1 the largest; 0 for no values.
[[nodiscard]] inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

}  // namespace dive::bench
