#pragma once
// One leg: from wherever the vehicle is to one goal. Plans, follows, replans on its triggers while
// it keeps following the path it has, and stays at the goal as long as asked. Where the path has
// lost its room nearer than the vehicle can stop, it holds and plans from there.

#include <optional>
#include <string>
#include <vector>

#include "behaviors/back_off.h"
#include "behaviors/behavior.h"
#include "behaviors/replan_triggers.h"
#include "vehicle/follower.h"

namespace dive::behaviors {

/// What holds for every leg of a mission.
struct LegSettings {
  double speed = 0.4;      ///< m/s
  double clearance = 0.6;  ///< D_min, m
  planning::AttitudeMode attitude = planning::AttitudeMode::kFree;
  double min_z = -50.0;       ///< Depth limit, m
  double min_altitude = 0.0;  ///< m above what is straight below
  double max_z = 0.0;         ///< m
  /// m that a path may lead above both where the leg began and its goal. Under a roof that nobody
  /// has charted the way up looks free: the eyes look down.
  std::optional<double> max_rise;
  ReplanPolicy replan;
  double goal_tolerance = 0.0;  ///< m that a goal that lacks clearance may be moved by.
  double retry_s = 1.0;         ///< Pause after a failed plan.
  int unreachable_after = 2;    ///< Failed plans in a row, without a path, that tell so.
  bool backs_off = false;       ///< In unknown water: see BackOff.
  double way_out_wait_s = 0.0;  ///< A way out that is blocked may be free again by then.
  std::uint64_t seed = 1;
};

struct LegGoal {
  std::string id;
  Eigen::Vector3d position_W;
  std::optional<double> yaw;    ///< rad; free when absent.
  double capture_radius = 0.5;  ///< m
  double dwell_s = 0.0;
};

/// The question to the planner: from a pose to a goal under the settings of the mission.
[[nodiscard]] planning::PlanRequest leg_request(const LegSettings& settings, const LegGoal& goal,
                                                const Pose& from_X_WB);

class Leg {
 public:
  Leg(const LegSettings& settings, LegGoal goal);

  /// One tick. `done` once the goal was reached and the dwell is over; `failed` when there is no
  /// path and the planner finds none, or the budget of replans is used up.
  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input);
  [[nodiscard]] const Progress& progress() const { return progress_; }
  /// The way that was planned leads where it cannot look: goes back a little and plans from there.
  /// False where it does not go back, and when it has gone back from here too often.
  [[nodiscard]] bool take_another_way();
  /// Goes back along the trail, and not to where it has not been.
  [[nodiscard]] bool is_backing_off() const { return back_off_.is_under_way(); }

 private:
  void take_answer(const BehaviorInput& input);
  [[nodiscard]] bool has_room_to_turn(const BehaviorInput& input) const;
  void plan_failed(Utime now, std::string why);
  [[nodiscard]] bool may_go_back() const;
  [[nodiscard]] bool go_back(const BehaviorInput& input, double least_m);
  [[nodiscard]] std::optional<BehaviorOutput> back_off(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput follow_on(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput without_path(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput follow(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput dwell(const BehaviorInput& input);
  void look_at_goal(const BehaviorInput& input);
  [[nodiscard]] std::optional<Eigen::Vector3d> nearest_on_the_way(const BehaviorInput& input) const;
  void ask(const BehaviorInput& input, const char* cause, BehaviorOutput& output,
           const std::optional<Eigen::Vector3d>& near_W = {});
  [[nodiscard]] double highest(const Eigen::Vector3d& p_W) const;
  [[nodiscard]] ReplanSignals signals(const BehaviorInput& input);
  [[nodiscard]] std::span<const Pose> rest_of_path() const;
  [[nodiscard]] std::vector<Pose> next_of_path(const Pose& X_WB) const;
  [[nodiscard]] bool is_cut_off(const BehaviorInput& input, double rest_m) const;

  LegSettings settings_;
  LegGoal goal_;
  vehicle::Follower follower_;
  ReplanTriggers triggers_;
  BackOff back_off_;
  Progress progress_;
  bool following_ = false;
  bool awaiting_plan_ = false;
  bool planned_in_vain_ = false;  ///< The answer leads through what was seen since it was asked.
  bool asked_near_ = false;       ///< For a way nearer to a goal that cannot be had, ...
  bool approaching_ = false;      ///< ... and this is it.
  int approached_after_ = 0;      ///< Failures.
  double certified_m_ = 0.0;      ///< Of the path, by the planner.
  Utime asked_at_ = 0;
  std::optional<Utime> retry_at_;
  std::optional<Utime> reached_at_;
  std::vector<Pose> way_there_;              ///< The last one that led to the goal.
  std::optional<vehicle::Command> station_;  ///< Held while there is no path.
  std::uint64_t requests_ = 0;
  std::optional<Utime> began_;
  double began_z_ = 0.0;
  std::optional<estimation::EstimatorKind> estimator_;
  bool told_unreachable_ = false;
  bool another_way_ = false;  ///< To be looked for.
  Eigen::Vector3d last_W_ = Eigen::Vector3d::Zero();
};

}  // namespace dive::behaviors
