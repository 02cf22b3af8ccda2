#pragma once
// Long paths are optimised stretch by stretch, so that a narrow passage a kilometre away costs
// nothing here: the work grows with the number of such passages, not with that number times the
// length.

#include <cstddef>
#include <vector>

namespace dive::planning {

/// Waypoints `first` to `last` of a path. These two are fixed.
struct Stretch {
  std::size_t first = 0;
  std::size_t last = 0;
};

/// Least number of waypoints of a stretch on either side of those to be moved, if the path has
/// them.
inline constexpr std::size_t kStretchMargin = 6;

/// Length in waypoints beyond which a stretch ends at the next waypoint without a violation.
inline constexpr std::size_t kLongStretch = 32;

/// The stretches, ascending, that contain all waypoints to be moved: those in `pulled` or
/// `violating` (of equal size). Neighbouring stretches may share an end; no end except the path's
/// own is `violating`.
[[nodiscard]] std::vector<Stretch> find_stretches(const std::vector<bool>& pulled,
                                                  const std::vector<bool>& violating);

}  // namespace dive::planning
