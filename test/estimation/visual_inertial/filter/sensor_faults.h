#pragma once
// Permanent sensor faults on a dive, of random size, from a given time on.

#include <string>
#include <vector>

#include "test/estimation/visual_inertial/filter/filter_dive.h"

namespace dive::testing {

/// Names of faults.
[[nodiscard]] const std::vector<std::string>& sensor_faults();
/// One of them, from `onset` (s) on.
[[nodiscard]] Hooks spoiled_by(const std::string& fault, double onset, Random& random);

/// Results of one dive with a fault, one sample a second.
struct FaultDive {
  int far = 0;         ///< Seconds with a position or attitude error of more than five sigma.
  int unreported = 0;  ///< Seconds of those without any flag.
  int flagged = 0;     ///< Seconds after the onset with a flag.
  int seconds = 0;     ///< Seconds after the onset.
  std::string reason;  ///< Reason of the last flag.
};
/// Twenty seconds in stereo, the fault after eight; "none" is a dive without one.
[[nodiscard]] FaultDive dive_with(const std::string& fault, std::uint64_t seed);

}  // namespace dive::testing
