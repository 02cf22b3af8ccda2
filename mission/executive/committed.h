#pragma once
// What outlives an executive: what a new one of the same mission needs to go on where another one
// ended, and how far the vehicle has gone in between.

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
#include "mission/statechart/interpreter.h"

namespace dive::mission {

struct Committed {
  Utime utime = 0;
  double elapsed_s = 0.0;                                   ///< Of the mission.
  std::vector<std::string> active;                          ///< Document order.
  std::vector<double> active_s;                             ///< How long, one by one.
  std::map<std::string, std::vector<std::string>> history;  ///< Recorded, by history state.
  std::vector<int> done_once;                               ///< Actions never to be repeated.
  Pose X_WB;
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  ///< m/s.
  double sigma_m = 0.0;                           ///< Of the horizontal position.
  std::optional<double> under_elapsed_s;          ///< When it was last in open water ...
  double under_battery = 1.0;                     ///< ... and with what charge.
  int goals_done = 0;                             ///< By the active leaf.
  behaviors::Rung rung = behaviors::Rung::kNone;
  behaviors::FailsafeKind rung_cause = behaviors::FailsafeKind::kLeak;
  std::string abort_cause;
  bool paused = false;
  std::int64_t queries = 0;
};

struct Resume {
  Committed committed;
  std::vector<behaviors::Trail::Crumb> trail;
  /// Between the last commit and the first step; nothing: as the vehicle's clock says, and the
  /// vehicle went on in between. Otherwise it lies at rest where it was, as in a new simulator.
  std::optional<double> gap_s;
};

/// Between the last commit and `now`, s; more than `longest_s` where the clock went back: then the
/// vehicle was away for nobody knows how long.
[[nodiscard]] double gap_of(const Resume& resume, Utime now, double longest_s);

/// What a vehicle did that nobody steered for a while.
struct Drift {
  Eigen::Vector2d by_W = Eigen::Vector2d::Zero();  ///< m
  double sigma_m = 0.0;                            ///< Of that.
  double surge = 0.0;                              ///< m/s that are left.
};

/// It swam on and then stopped, by itself, as the link's vehicles do.
[[nodiscard]] Drift drift_in(double gap_s, const Committed& committed);

/// What the chart remembers goes into `committed` by the names of its states, and comes back. A
/// name that is not the chart's is an error of ours (demanded).
void keep_memory(const statechart::Interpreter::Memory& memory, const statechart::Chart& chart,
                 Committed& committed);
[[nodiscard]] statechart::Interpreter::Memory memory_of(const Committed& committed,
                                                        const statechart::Chart& chart);

}  // namespace dive::mission
