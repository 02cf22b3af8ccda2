#pragma once
// retrace: back along the breadcrumb trail to the last point with open water above. The vehicle has
// swum that path, so it is free unless an obstacle has been mapped on it since. In that case, and
// when the vehicle makes no progress, a detour is planned, each time with less clearance. With open
// water above the vehicle stops, checks again, and is done. Before it turns back it stops and comes
// level. Without attitude it cannot swim: it waits, and is done once there is open water above.
//
// Its states and transitions: retrace_state.h. What is tried next, and how often: recovery.h.

#include <optional>
#include <span>
#include <vector>

#include "behaviors/behavior.h"
#include "behaviors/drift_stop.h"
#include "behaviors/leg.h"
#include "behaviors/plan_client.h"
#include "behaviors/recovery.h"
#include "behaviors/retrace_state.h"
#include "behaviors/trail.h"
#include "vehicle/follower.h"

namespace dive::behaviors {

class Retrace final : public Behavior {
 public:
  /// Keeps a reference to the trail. `changes` measures its clearance to all obstacles mapped since
  /// the dive began; null: none.
  Retrace(const Trail& trail, const LegSettings& settings, PathEvaluator* changes);

  /// `failed` (kExhausted) when the trail never had open water above, or neither the trail nor any
  /// planned path can be followed. In a known environment, if by the map the vehicle is inside
  /// an obstacle, it first follows the trail slowly whatever the map shows on it: the map or the
  /// position is wrong, it has come that way, and the other way is up, against the overhead. Where
  /// a scan shows an obstacle in its way it holds station and tries again, for
  /// BlockedTrailOptions::hold_s.
  ///
  /// In an unknown environment (BlockedTrailOptions::wait_s) an obstacle on the trail may move, and
  /// no other exit path is known: the vehicle observes the trail for a while, then plans a detour
  /// back onto the trail and hardly above it, and repeats this until the time is over.
  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }
  [[nodiscard]] bool needs_free_ahead() const override { return is_off_trail_; }
  void way_ahead(const Pose& X_WB, double seconds, std::vector<Pose>& way) const override;
  [[nodiscard]] bool request_alternative() override { return alternative_requested_ = true; }

 private:
  // One tick in a state. `output` starts as the command to keep station.
  void run(const BehaviorInput& input, BehaviorOutput& output, bool wants_alternative = false);
  void stop(retrace::Stopping& stopping, const BehaviorInput& input, BehaviorOutput& output);
  void come_level(Utime since, const BehaviorInput& input, BehaviorOutput& output);
  void follow(double allowed_s, const BehaviorInput& input, BehaviorOutput& output,
              bool wants_alternative = false);
  void observe_trail(Utime since, const BehaviorInput& input, BehaviorOutput& output);
  void plan_detour(retrace::Loss cause, const BehaviorInput& input, BehaviorOutput& output);

  // Transitions between states.
  void raise(const retrace::Event& event) { state_ = retrace::transition(state_, event); }
  [[nodiscard]] bool find_trail(const BehaviorInput& input, double speed);
  void begin_trail(const BehaviorInput& input);
  void trust_trail(const BehaviorInput& input, BehaviorOutput& output);
  void arrive(const BehaviorInput& input, BehaviorOutput& output);
  void lose_path(retrace::Loss cause, const BehaviorInput& input);
  void begin_observation(const BehaviorInput& input);
  void take_answer(const BehaviorInput& input);

  [[nodiscard]] bool is_stopping() const;
  [[nodiscard]] bool has_stopped(const BehaviorInput& input) const;
  [[nodiscard]] bool is_blocked(PathEvaluator& changes) const;
  [[nodiscard]] bool is_inside_an_obstacle(const Pose& X_WB) const;
  [[nodiscard]] Eigen::Quaterniond stopping_attitude(const estimation::StateEstimate& estimate);
  [[nodiscard]] Trail::Path path_along_trail(const Eigen::Vector3d& p_W) const;
  void set_path(std::span<const Pose> waypoints, double length_m, double speed,
                const Eigen::Vector3d& p_W);
  [[nodiscard]] double clearance_at_end(const Trail::Path& path) const;
  [[nodiscard]] double time_allowed_s(double length_m) const;
  vehicle::Command& station(const Pose& X_WB);
  void aim(const Eigen::Vector3d& p_W, LegSettings& settings, LegGoal& goal) const;

  const Trail& trail_;
  PathEvaluator* changes_;
  LegSettings settings_;
  retrace::State state_;
  TrailRecovery recovery_;
  vehicle::Follower follower_;
  PlanClient planner_;
  PathCheck check_;  ///< When the path ahead is evaluated again.
  DriftStop drift_stop_;
  Progress progress_;
  std::optional<Utime> since_;  ///< Time at which it began to stop, or to follow; with attitude.
  std::optional<vehicle::Command> station_;          ///< Station kept; empty while following.
  Eigen::Vector3d out_W_ = Eigen::Vector3d::Zero();  ///< End of the exit path along the trail.
  bool is_off_trail_ = false;           ///< True on a detour, and after it until back on the trail.
  bool alternative_requested_ = false;  ///< Requested since the last tick.
  int arrivals_ = 0;                    ///< Number of arrivals at expected open water.
};

}  // namespace dive::behaviors
