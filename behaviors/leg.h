#pragma once
// One leg: from the vehicle's position to one goal. Plans, follows the path, replans on its
// triggers while it keeps following, and stays at the goal for the dwell time. Where the path has
// lost its clearance within the stopping distance, or a scan shows an obstacle in the vehicle's
// way, it holds and plans from there. In an unknown environment it backs off along its trail, and
// observes a goal that it cannot reach.
//
// Its states and transitions: leg_state.h. What is tried next, and how often: recovery.h.

#include <optional>
#include <string>
#include <vector>

#include "behaviors/behavior.h"
#include "behaviors/leg_state.h"
#include "behaviors/plan_client.h"
#include "behaviors/recovery.h"
#include "behaviors/replan_triggers.h"
#include "vehicle/follower.h"

namespace dive::behaviors {

/// Settings that all legs of a mission share.
struct LegSettings {
  double speed = 0.4;  ///< m/s
  /// A vehicle that drifted too near to an obstacle may start with the clearance it has.
  planning::MotionLimits limits = {.reduced_clearance = 0.0};
  /// Height by which a path may rise above both the leg's start and its goal, m: where the mission
  /// limits it, and under an overhead that is on no map, which the sensor does not observe because
  /// it points down.
  std::optional<double> max_rise;
  std::optional<double> max_drop;  ///< The same, below both, m.
  ReplanPolicy replan;
  RecoveryOptions recovery;
  std::uint64_t seed = 1;
};

struct LegGoal {
  std::string id;
  Eigen::Vector3d position_W;
  std::optional<double> yaw;    ///< rad; free when absent.
  double capture_radius = 0.5;  ///< m
  double dwell_s = 0.0;
};

/// Request to the planner: from a pose to a goal, with the settings of the mission. It offers the
/// trail where that leads to the goal; null: none.
[[nodiscard]] planning::PlanRequest leg_request(const LegSettings& settings, const LegGoal& goal,
                                                const Pose& from_X_WB,
                                                const Trail* trail = nullptr);

class Leg {
 public:
  Leg(const LegSettings& settings, LegGoal goal);

  /// Advances one tick. `done` once the goal is reached and the dwell is over; `failed` when there
  /// is no path and the planner finds none, or the budget of replans is used up.
  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input);
  [[nodiscard]] const Progress& progress() const { return progress_; }
  /// Called when the path ahead cannot be observed: on the next tick the vehicle backs off a little
  /// and plans from there. Returns false if it may not back off, or has done so from here too
  /// often.
  [[nodiscard]] bool request_alternative();
  /// See Behavior::way_ahead().
  void way_ahead(const Pose& X_WB, double seconds, std::vector<Pose>& way) const;
  /// True while it backs off along the trail, where the vehicle has been.
  [[nodiscard]] bool is_backing_off() const;

 private:
  [[nodiscard]] bool take_answer(const BehaviorInput& input);
  void take_path(const BehaviorInput& input, double clearance_m);
  [[nodiscard]] Failure back_off_if_needed(const BehaviorInput& input);
  [[nodiscard]] std::vector<Pose> way_to_stop(const BehaviorInput& input) const;
  [[nodiscard]] bool leaves_obstacle(std::span<const Pose> way, const BehaviorInput& input) const;
  [[nodiscard]] bool begin_back_off(const BehaviorInput& input, LegRecovery::BackOffReason reason);

  [[nodiscard]] BehaviorOutput run(const BehaviorInput& input, bool is_outdated = false);
  [[nodiscard]] BehaviorOutput plan(leg::Planning& planning, const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput follow(double certified_m, const BehaviorInput& input,
                                      bool is_outdated);
  [[nodiscard]] vehicle::Command stop_here(const BehaviorInput& input) const;
  [[nodiscard]] BehaviorOutput stop_for_obstacle(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput back_off(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput dwell(const leg::Dwelling& dwelling, const BehaviorInput& input);

  void ask(const BehaviorInput& input, const char* cause, BehaviorOutput& output,
           const std::optional<Eigen::Vector3d>& place_W = {});
  void raise(const leg::Event& event) { state_ = leg::transition(state_, event); }
  [[nodiscard]] bool is_following() const;
  [[nodiscard]] ReplanSignals signals(const BehaviorInput& input, double certified_m);
  [[nodiscard]] std::span<const Pose> rest_of_path() const;
  [[nodiscard]] bool is_cut_off(const BehaviorInput& input, double certified_m);

  LegSettings settings_;
  LegGoal goal_;
  leg::State state_;
  LegRecovery recovery_;
  vehicle::Follower follower_;
  ReplanTriggers triggers_;
  PlanClient planner_;
  Progress progress_;
  std::vector<Pose> route_to_goal_;                     ///< Last path that led to the goal.
  std::uint64_t requests_ = 0;                          ///< Number of plans requested.
  const char* need_ = "the leg starts";                 ///< Why a plan is needed without a path.
  std::optional<Utime> began_;                          ///< Time of the first tick.
  double began_z_ = 0.0;                                ///< z of the vehicle at the first tick, m.
  Eigen::Vector3d p_W_ = Eigen::Vector3d::Zero();       ///< Position at the last tick.
  std::optional<estimation::EstimatorKind> estimator_;  ///< Source of the estimate followed last.
  double rest_m_ = 0.0;  ///< Clearance of the rest of the path when last evaluated, m.
  PathCheck check_;      ///< When a path that is blocked farther on is evaluated again.
  bool map_opened_ =
      false;  ///< True if an obstacle has gone since the last request to the planner.
  bool alternative_requested_ = false;  ///< True if requested since the last tick.
};

}  // namespace dive::behaviors
