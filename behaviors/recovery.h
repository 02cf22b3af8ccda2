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

/// A leg on its way to a goal.
class LegRecovery {
 public:
  /// `d_min_m`: D_min, m. Demands valid options.
  LegRecovery(double d_min_m, const RecoveryOptions& options);

  // Wait, and plan again.
  void plan_failed(Utime now);
  void path_found(bool leads_to_goal);
  /// Number of failed plans since the last path to the goal.
  [[nodiscard]] int failures() const { return failures_; }
  [[nodiscard]] bool is_pausing(Utime now) const { return pause_until_ && now < *pause_until_; }
  /// True once for each path that is missing, after RecoveryOptions::unreachable_after failures.
  [[nodiscard]] bool reports_unreachable();

  // Observe the goal.
  /// Attitude in which the bow points to the goal. None where no plan has failed, or where there is
  /// no clearance to turn.
  [[nodiscard]] std::optional<Eigen::Quaterniond> attitude_to_observe(
      const BehaviorInput& input, const Eigen::Vector3d& goal_W) const;
  /// Once for each plan. The place from which to observe the goal: the nearest to it that has
  /// clearance on `route`, the last path to the goal, or on the straight line if that is empty.
  /// None until enough plans have failed, and where there is no such place.
  [[nodiscard]] std::optional<Eigen::Vector3d> place_to_observe(const BehaviorInput& input,
                                                                const Eigen::Vector3d& goal_W,
                                                                std::span<const Pose> route);

  // Back off.
  enum class BackOffReason {
    kTooNear,    ///< To where there is clearance.
    kOtherPath,  ///< To where the planner may find another path.
  };
  /// Once a tick while the vehicle is not backing off.
  [[nodiscard]] bool is_too_near(const BehaviorInput& input);
  /// False after too many attempts from about `p_W`.
  [[nodiscard]] bool may_back_off(const Eigen::Vector3d& p_W) const;
  /// False where the turn onto `path` leaves too little clearance, and the vehicle may back off.
  [[nodiscard]] bool can_turn_onto(std::span<const Pose> path, const BehaviorInput& input) const;
  /// False when there is no path back to a place with more clearance.
  [[nodiscard]] bool begin_back_off(const BehaviorInput& input, BackOffReason reason);
  /// True once, when the vehicle has begun to back off too often from `p_W`.
  [[nodiscard]] bool reports_too_many(const Eigen::Vector3d& p_W);
  /// Once a tick while backing off; nothing when that has ended.
  [[nodiscard]] std::optional<vehicle::Command> back_off(const BehaviorInput& input);
  /// Clearance of the vehicle when it was last measured, m.
  [[nodiscard]] double clearance_m() const { return back_off_.clearance_m(); }

 private:
  double d_min_m_;
  RecoveryOptions options_;
  BackOff back_off_;
  int failures_ = 0;
  int failures_to_approach_ = 0;      ///< Failed plans since the goal was last approached.
  bool is_reported_ = false;          ///< The goal was reported unreachable since the last path.
  std::optional<Utime> pause_until_;  ///< Time of the next plan after a failure.
};

/// A retrace whose path out is blocked: observe it, then plan a detour, with less and less
/// clearance, and so on until the time is over.
class TrailRecovery {
 public:
  /// `d_min_m`: D_min, m. Demands valid options.
  TrailRecovery(double d_min_m, const RecoveryOptions& options);

  /// True in an unknown environment: what blocks the trail may go away, and only the trail is known
  /// to lead out.
  [[nodiscard]] bool is_patient() const { return options_.wait_s > 0.0; }
  /// Clearance that the trail must have, m. A diver beside it is given room, a trail that has no
  /// more is swum in the end.
  [[nodiscard]] double needed_on_trail_m() const;

  /// The path that the vehicle follows is lost. What blocks it may be another thing than before:
  /// then the attempts count again.
  void path_lost(const Eigen::Vector3d& p_W);
  /// True if the trail is to be observed before a detour is planned.
  [[nodiscard]] bool observes_first() const;

  void observation_begun(const Eigen::Vector3d& p_W, Utime now);
  [[nodiscard]] bool is_observed(Utime since, Utime now) const;
  /// The trail was observed: detours are planned with all of D_min again.
  void observation_ended() { tries_ = 0; }
  [[nodiscard]] bool gives_up(Utime now) const;

  /// Number of detours asked for, in a row.
  [[nodiscard]] int tries() const { return tries_; }
  /// Once for each plan. Clearance of the next detour, m; none after the last.
  [[nodiscard]] std::optional<double> next_clearance();
  void detour_found(const Eigen::Vector3d& p_W);

 private:
  double d_min_m_;
  BlockedTrailOptions options_;
  int observations_ = 0;  ///< Observations in a row, from about one place.
  std::optional<Eigen::Vector3d> observed_from_W_;  ///< Place of the last observation.
  std::optional<Utime> blocked_since_;  ///< Time of the first one without progress since.
  int tries_ = 0;
  int detours_ = 0;  ///< Detours found.
  std::optional<Eigen::Vector3d>
      detour_from_W_;  ///< Start of the last one, until it made progress.
};

}  // namespace dive::behaviors
