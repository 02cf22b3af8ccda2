#pragma once
// Recovery from obstructions: which step comes next, from where and how often, and when to give up.
// The behaviour executes the steps. README.md has their order.

#include <optional>
#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "behaviors/back_off.h"
#include "behaviors/behavior.h"
#include "behaviors/recovery_options.h"

namespace dive::behaviors {

/// Recovery of a leg.
class LegRecovery {
 public:
  /// `d_min_m`: D_min, m. Demands valid options.
  LegRecovery(double d_min_m, const RecoveryOptions& options);

  // Recovery by another plan after a pause.
  void plan_failed(Utime now);
  /// Called when a scan has shown an obstacle in the way, which the map may not have yet. False if
  /// it has stopped for one at about `p_W` too often: no plan leads around it.
  [[nodiscard]] bool stopped_for_obstacle(const Eigen::Vector3d& p_W, Utime now);
  void path_found(bool leads_to_goal);
  /// Number of failed plans since the last path to the goal.
  [[nodiscard]] int failures() const { return failures_; }
  [[nodiscard]] bool is_pausing(Utime now) const { return pause_until_ && now < *pause_until_; }
  /// True once for each path that is missing, after RecoveryOptions::unreachable_after failures.
  [[nodiscard]] bool reports_unreachable();

  // Recovery by observing the goal.
  /// Attitude in which the bow points to the goal. Empty if no plan has failed, or if there is no
  /// clearance to turn.
  [[nodiscard]] std::optional<Eigen::Quaterniond> attitude_to_observe(
      const BehaviorInput& input, const Eigen::Vector3d& goal_W) const;
  /// Called once for each plan. The place from which to observe the goal: the nearest to it that
  /// has clearance on `route`, the last path to the goal, or on the straight line if that is empty.
  /// Empty until enough plans have failed, and if there is no such place.
  [[nodiscard]] std::optional<Eigen::Vector3d> place_to_observe(const BehaviorInput& input,
                                                                const Eigen::Vector3d& goal_W,
                                                                std::span<const Pose> route);

  // Recovery by backing off.
  enum class BackOffReason {
    kTooNear,    ///< Too near to an obstacle: back to a place with clearance.
    kOtherPath,  ///< Alternative path requested: back to a place with another path.
    kNoRoom,     ///< The same, if the way back leaves no less clearance than the last turn_onto().
  };
  /// Called once per tick while the vehicle is not backing off. In a known environment true only
  /// beside an obstacle that the map lacks.
  [[nodiscard]] bool is_too_near(const BehaviorInput& input);
  /// False after too many attempts from about `p_W`.
  [[nodiscard]] bool may_back_off(const Eigen::Vector3d& p_W) const;
  /// The turn with which a path begins.
  enum class TurnOnto {
    kPossible,
    kAfterStop,  ///< Too sharp for a vehicle under way.
    kNoRoom,     ///< Made almost on the spot, it leaves too little clearance.
  };
  [[nodiscard]] TurnOnto turn_onto(std::span<const Pose> path, const BehaviorInput& input);
  /// Roll in which to stop, rad. On its side a vehicle that holds its depth moves sideways, so it
  /// comes level if the map shows room for it: it may have swum on its side because there is none.
  [[nodiscard]] double roll_to_stop(const BehaviorInput& input) const;
  /// A path was refused for that turn: the next is planned after a pause.
  void path_refused(Utime now);
  /// False when there is no path back to a place with more clearance.
  [[nodiscard]] bool begin_back_off(const BehaviorInput& input, BackOffReason reason);
  /// True once, when the vehicle has backed off too often from about `p_W`.
  [[nodiscard]] bool reports_too_many(const Eigen::Vector3d& p_W);
  /// Called once per tick while backing off; empty when that has ended.
  [[nodiscard]] std::optional<vehicle::Command> back_off(const BehaviorInput& input);
  /// Clearance of the vehicle when it was last measured, m.
  [[nodiscard]] double clearance_m() const { return back_off_.clearance_m(); }

 private:
  [[nodiscard]] bool is_beside_unmapped(const BehaviorInput& input) const;
  [[nodiscard]] double least_turn_clearance() const;

  double d_min_m_;
  RecoveryOptions options_;
  BackOff back_off_;
  int failures_ = 0;
  int failures_to_approach_ = 0;  ///< Failed plans since the goal was last approached.
  bool is_reported_ = false;  ///< True if the goal was reported unreachable since the last path.
  std::optional<Utime> pause_until_;  ///< Time of the next plan.
  double turn_clearance_m_ = 0.0;     ///< Clearance of the last turn_onto(), m.
  int stops_ = 0;                     ///< Stops in a row for an obstacle at about one place.
  Eigen::Vector3d stopped_at_W_ = Eigen::Vector3d::Zero();
};

/// Recovery of a retrace whose exit path is blocked: observe it, then plan detours with decreasing
/// clearance, and repeat until the time is over.
class TrailRecovery {
 public:
  /// `d_min_m`: D_min, m. Demands valid options.
  TrailRecovery(double d_min_m, const RecoveryOptions& options);

  /// True in an unknown environment: what blocks the trail may go away, and only the trail is known
  /// to lead out.
  [[nodiscard]] bool is_patient() const { return options_.wait_s > 0.0; }
  /// Clearance that the trail must have, m. At first enough to pass a diver; in the end a trail
  /// with less clearance is accepted.
  [[nodiscard]] double needed_on_trail_m() const;

  /// Records that the path being followed is blocked. Elsewhere than before another obstacle may
  /// block it: then the attempts are counted from 0.
  void path_lost(const Eigen::Vector3d& p_W);
  /// True if the trail is to be observed before a detour is planned.
  [[nodiscard]] bool observes_first() const;

  void observation_begun(const Eigen::Vector3d& p_W, Utime now);
  [[nodiscard]] bool is_observed(Utime since, Utime now) const;
  /// Records the end of an observation: detours are planned with all of D_min again.
  void observation_ended() { tries_ = 0; }
  /// True if the trail is to be followed whatever is mapped on it, now that there is no detour: in
  /// a known environment, if by the map the vehicle is inside an obstacle, which it cannot be, and
  /// then for hold_s.
  [[nodiscard]] bool may_trust_trail(bool is_inside, Utime now) const;
  void trust_begun(Utime now);
  [[nodiscard]] bool gives_up(Utime now) const;

  /// Number of detours requested in a row.
  [[nodiscard]] int tries() const { return tries_; }
  /// Called once for each plan. Clearance of the next detour, m; empty after the last.
  [[nodiscard]] std::optional<double> next_clearance();
  void detour_found(const Eigen::Vector3d& p_W);

 private:
  double d_min_m_;
  BlockedTrailOptions options_;
  int observations_ = 0;  ///< Observations in a row, from about one place.
  std::optional<Eigen::Vector3d> observed_from_W_;  ///< Place of the last observation.
  std::optional<Utime> trusted_since_;              ///< Time at which the trail was first trusted.
  std::optional<Utime> blocked_since_;  ///< Time of the first observation without progress since.
  int tries_ = 0;
  int detours_ = 0;  ///< Number of detours found.
  /// Start of the last detour, until the vehicle makes progress on it.
  std::optional<Eigen::Vector3d> detour_from_W_;
};

}  // namespace dive::behaviors
