#pragma once
// When a range scan can be placed by the pose at its time. Shared by mapper and map matching.

#include "common/clock.h"
#include "estimation/state_estimate.h"

namespace dive::mission {

/// us from a scan to the nearest known pose: a scan farther away is dropped.
inline constexpr Utime kMaxTimeOffset = 100'000;

/// False without a position, and with an attitude so uncertain (0.3 rad, one sigma) that walls
/// would lie where none are.
[[nodiscard]] inline bool can_place_scans(const estimation::StateEstimate& estimate) {
  return estimate.valid && attitude_sigma(estimate) <= 0.3;
}

}  // namespace dive::mission
