#pragma once
// Sensors that go wrong on a dive, of random size, at a given time and for good.

#include <string>
#include <vector>

#include "test/estimation/visual_inertial/filter_dive.h"

namespace dive::testing {

/// Names of faults.
[[nodiscard]] const std::vector<std::string>& sensor_faults();
/// One of them, from `onset` (s) on.
[[nodiscard]] Hooks spoiled_by(const std::string& fault, double onset, Random& random);

/// What one dive with a fault shows, a sample a second.
struct FaultDive {
  int far = 0;       ///< Seconds in which position or attitude are more than five sigma off,
  int untold = 0;    ///< and of those, how many nothing flags.
  int flagged = 0;   ///< Seconds after the onset that something flags.
  int seconds = 0;   ///< After the onset.
  std::string told;  ///< The last flag's reason.
};
/// Twenty seconds in stereo, the fault after eight; "none" is a dive without.
[[nodiscard]] FaultDive dive_with(const std::string& fault, std::uint64_t seed);

}  // namespace dive::testing
