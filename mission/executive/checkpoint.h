#pragma once
// The saved state of an executive: what a new executive of the same mission needs to continue, and
// how far the vehicle has moved in between.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "behaviors/failsafes.h"
#include "behaviors/trail.h"
#include "common/clock.h"
#include "common/se3.h"
#include "estimation/imu_bias.h"
#include "mission/statechart/interpreter.h"

namespace dive::mission {

struct Checkpoint {
  Utime utime = 0;
  double elapsed_s = 0.0;           ///< Time since the mission started.
  std::vector<std::string> active;  ///< Document order.
  /// Time since entry of each active state, s.
  std::vector<double> active_s;
  /// Recorded states of each history state.
  std::map<std::string, std::vector<std::string>> history;
  /// Actions already executed that must not be repeated.
  std::vector<int> done_once;
  Pose X_WB;
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  ///< Velocity, m/s.
  /// Standard deviation of the horizontal position, m.
  double sigma_m = 0.0;
  std::optional<double> open_water_elapsed_s;  ///< Time when the vehicle was last in open water.
  double open_water_battery = 1.0;             ///< Charge at that time, fraction.
  int goals_done = 0;                          ///< Goals completed by the active atomic state.
  behaviors::Rung rung = behaviors::Rung::kNone;
  behaviors::FailsafeKind rung_cause = behaviors::FailsafeKind::kLeak;
  std::string abort_cause;
  bool paused = false;
  std::int64_t queries = 0;
  /// Of the visual-inertial estimator, which is beside the executive; absent without one, and until
  /// it has proved them.
  std::optional<estimation::ImuBias> imu_bias;
};

struct Resume {
  Checkpoint checkpoint;
  std::vector<behaviors::Trail::Breadcrumb> trail;
  double trail_spacing_m = behaviors::kTrailSpacing;  ///< Trail::spacing().
  /// Time between the last commit and the first step; absent: taken from the vehicle's clock, and
  /// the vehicle kept moving in between. If given, the vehicle lies at rest where it was, as in a
  /// new simulator.
  std::optional<double> gap_s;
};

/// Time between the last commit and `now`, s; more than `longest_s` if the clock went back, because
/// the absence is then of unknown length.
[[nodiscard]] double gap_of(const Resume& resume, Utime now, double longest_s);

/// Motion of a vehicle without commands.
struct Drift {
  Eigen::Vector2d by_W = Eigen::Vector2d::Zero();  ///< Horizontal displacement, m.
  double sigma_m = 0.0;                            ///< Standard deviation of the displacement, m.
  double surge = 0.0;                              ///< Remaining surge speed, m/s.
  double lost = 0.0;                               ///< Surge speed lost meanwhile, m/s.
};

/// Drift of a vehicle that continued its motion and then stopped by itself in water that flows with
/// `current_W` (m/s), as over the link.
[[nodiscard]] Drift drift_in(double gap_s, const Checkpoint& checkpoint,
                             const Eigen::Vector2d& current_W);

/// Saves the chart's memory in `checkpoint` by state names, and restores it. A name that is not in
/// the chart is an internal error (checked).
void keep_memory(const statechart::Interpreter::Memory& memory, const statechart::Chart& chart,
                 Checkpoint& checkpoint);
[[nodiscard]] statechart::Interpreter::Memory memory_of(const Checkpoint& checkpoint,
                                                        const statechart::Chart& chart);

}  // namespace dive::mission
