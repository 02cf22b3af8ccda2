#pragma once
// In unknown water: what a vehicle may do of what it is told, by what it has seen.

#include <optional>

#include <Eigen/Core>

#include "behaviors/seen_ahead.h"
#include "estimation/state_estimate.h"
#include "vehicle/command.h"

namespace dive::behaviors {

/// No faster than it can stop, not up to where it did not look, and not for ever at the edge of its
/// sight.
class SightLimit {
 public:
  explicit SightLimit(SeenAheadOptions options) : ahead_(options) {}

  /// As SeenAhead's.
  void advance(Utime now, const Eigen::Vector3d& p_W) { ahead_.advance(now, p_W); }
  void hear(Utime scan_utime, double seen_ahead_m) { ahead_.hear(scan_utime, seen_ahead_m); }

  /// Takes from `command` what cannot be seen to be safe. `leaf_now` is the behaviours' clock.
  void apply(Utime now, Utime leaf_now, const estimation::StateEstimate& estimate,
             vehicle::Command& command);
  /// True when the vehicle has turned towards its path for long enough and still does not observe
  /// it: most likely the path leads up behind an obstacle. The wait begins again with the next
  /// call, and whenever the commanded heading changes.
  [[nodiscard]] bool waits_in_vain(Utime leaf_now);
  /// Another behaviour begins: it has not waited yet.
  void stop_waiting() { waiting_.reset(); }

 private:
  /// Since when and where the vehicle waits to see more.
  struct Waiting {
    Utime since = 0;
    Eigen::Vector3d p_W;
    double yaw = 0.0;  ///< rad, that it is told.
  };

  SeenAhead ahead_;
  std::optional<Waiting> waiting_;
  std::optional<double> blocked_depth_;  ///< Where it came to the end of its sight, m.
};

/// A vehicle that turns under way slides on, for seconds, stern first or sideways, and nothing on
/// board can stop a slide sideways; and a slow vehicle that is pushed back stays behind: the
/// autopilot steers its speed by what it has commanded, and the drag of a slow hull is next to
/// nothing. At `surge` (m/s, negative: astern) this asks for more, or less, than was commanded.
/// From `yaw` (rad) a sharp turn begins only when the vehicle has all but stopped, and gathers no
/// way before it has ended. To be called after any limit by sight: that must not forbid to stop.
void hold_speed(double surge, double yaw, vehicle::Command& command);

}  // namespace dive::behaviors
