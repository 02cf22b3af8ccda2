#pragma once
// retrace: back along the breadcrumb trail to the last point with open water above. The vehicle
// swam that path once, so it is known to be free, unless the map has shown something on it since.
// Then, and when the vehicle makes no progress, a detour is planned, with less and less clearance.
// With open water above it stops, checks again, and is done. Before it turns back it stops as it is
// and comes level. Without attitude it cannot swim: it waits, and is done as soon as there is open
// water above.
//
// Its states and transitions: retrace_state.h. What is tried next, and how often: recovery.h.

#include <optional>
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
  /// Keeps a reference to the trail. `changes` judges it against all that the map has shown since
  /// the dive began; null: nothing.
  Retrace(const Trail& trail, const LegSettings& settings, PathJudge* changes);

  /// `failed` (kExhausted) when the trail never saw open water, or neither the trail nor any
  /// planned path can be swum.
  ///
  /// In an unknown environment (BlockedTrailOptions::wait_s) what blocks the trail may go away, and
  /// no other path out is known: the vehicle observes the trail for a while, then plans a detour
  /// back onto the trail and hardly higher than that, and so on for as long as it may.
  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }
  [[nodiscard]] bool needs_free_ahead() const override { return is_off_trail_; }
  [[nodiscard]] bool request_alternative() override { return alternative_requested_ = true; }

 private:
  // One tick in a state. The command of `output` is to hold the place; each changes what differs.
  void run(const BehaviorInput& input, BehaviorOutput& output, bool wants_alternative = false);
  void stop(retrace::Stopping& stopping, const BehaviorInput& input, BehaviorOutput& output);
  void come_level(Utime since, const BehaviorInput& input, BehaviorOutput& output);
  void follow(double allowed_s, const BehaviorInput& input, BehaviorOutput& output,
              bool wants_alternative = false);
  void observe_trail(Utime since, const BehaviorInput& input, BehaviorOutput& output);
  void plan_detour(retrace::Loss cause, const BehaviorInput& input, BehaviorOutput& output);

  // What leads from state to state.
  void raise(const retrace::Event& event) { state_ = retrace::transition(state_, event); }
  void begin_trail(const BehaviorInput& input);
  void arrive(const BehaviorInput& input, BehaviorOutput& output);
  void lose_path(retrace::Loss cause, const BehaviorInput& input);
  void begin_observation(const BehaviorInput& input);
  void take_answer(const BehaviorInput& input);

  [[nodiscard]] bool is_stopping() const;
  [[nodiscard]] bool has_stopped(const BehaviorInput& input) const;
  [[nodiscard]] bool is_blocked(PathJudge& changes) const;
  [[nodiscard]] Eigen::Quaterniond stopping_attitude(const estimation::StateEstimate& estimate);
  [[nodiscard]] Trail::Way way_along_trail(const Eigen::Vector3d& p_W) const;
  [[nodiscard]] double time_allowed_s(double length_m) const;
  vehicle::Command& station(const Pose& X_WB);
  void aim(const Eigen::Vector3d& p_W, LegSettings& settings, LegGoal& goal) const;

  const Trail& trail_;
  PathJudge* changes_;
  LegSettings settings_;
  retrace::State state_;
  TrailRecovery recovery_;
  vehicle::Follower follower_;
  PlanClient planner_;
  DriftStop drift_stop_;
  Progress progress_;
  std::optional<Utime> since_;  ///< Time at which it began to stop, or to follow; with attitude.
  std::optional<vehicle::Command> station_;          ///< Place that it holds; none while following.
  Eigen::Vector3d out_W_ = Eigen::Vector3d::Zero();  ///< End of the trail's path out.
  bool is_off_trail_ = false;           ///< It has followed a detour, and the trail not since.
  bool alternative_requested_ = false;  ///< Since the last tick.
  int arrivals_ = 0;                    ///< At places that were to be open water.
};

}  // namespace dive::behaviors
