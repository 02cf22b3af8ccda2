#pragma once
// Limits on the command in an unknown environment, by the space observed free.

#include <optional>

#include <Eigen/Core>

#include "behaviors/stopping_speed.h"
#include "estimation/state_estimate.h"
#include "vehicle/command.h"

namespace dive::behaviors {

/// Limits the speed to what allows a stop in observed space, forbids an ascent into unobserved
/// space, and ends the wait at the edge of the observed space.
class ViewSpeedLimit {
 public:
  explicit ViewSpeedLimit(StoppingSpeedOptions options) : ahead_(options) {}

  /// See StoppingSpeed.
  void advance(Utime now, const Eigen::Vector3d& p_W) { ahead_.advance(now, p_W); }
  void add_scan(Utime scan_utime, double free_ahead_m) {
    ahead_.add_scan(scan_utime, free_ahead_m);
  }

  /// Removes from `command` the motion into space not observed free. `behavior_now` is the
  /// behaviours' clock.
  void apply(Utime now, Utime behavior_now, const estimation::StateEstimate& estimate,
             vehicle::Command& command);
  /// True when the vehicle has turned towards its path for long enough and the path is still not
  /// observed: most likely it leads up behind an obstacle. The wait starts again with the next
  /// call, and whenever the commanded heading changes.
  [[nodiscard]] bool view_timed_out(Utime behavior_now);
  /// Resets the wait, when another behaviour starts.
  void stop_waiting() { waiting_.reset(); }

 private:
  /// A wait for new observations.
  struct Waiting {
    Utime since = 0;
    Eigen::Vector3d p_W;
    double yaw = 0.0;  ///< Commanded heading, rad.
  };

  StoppingSpeed ahead_;
  std::optional<Waiting> waiting_;
  std::optional<double> blocked_depth_;  ///< Depth at the edge of the observed space, m.
};

/// Compensates the difference between the commanded speed and the measured `surge` (m/s, negative:
/// astern), up to 0.3 m/s. The autopilot controls speed without feedback and the drag of a slow
/// hull is very small, so that a vehicle that is pushed back, or drifts with the water, would not
/// recover. Call it after all speed limits, because they must not prevent braking.
void hold_speed(double surge, vehicle::Command& command);

/// hold_speed(), and a stop before sharp turns. A vehicle that turns in motion slides
/// stern first or sideways for seconds, and no flipper can stop a sideways slide: from `yaw` (rad)
/// a sharp turn starts only when the vehicle has almost stopped, and there is no forward speed
/// until it is over.
void compensate_drift(double surge, double yaw, vehicle::Command& command);

}  // namespace dive::behaviors
