#pragma once
// retrace: back along the breadcrumb trail to the last point with open water above. The way was
// swum once, so it is known to be free, unless the map has shown something in it since: then, and
// when the vehicle does not get on, a way out is planned, with less and less clearance. Where
// nothing is overhead it stops, looks again, and is done. Without attitude nothing can be swum: it
// waits, or goes up as soon as nothing is straight above.

#include <optional>
#include <vector>

#include "behaviors/behavior.h"
#include "behaviors/leg.h"
#include "behaviors/trail.h"
#include "vehicle/follower.h"

namespace dive::behaviors {

class Retrace final : public Behavior {
 public:
  /// Keeps a reference to the trail. `changes` judges it against all that the map has shown since
  /// the dive began; null: nothing.
  Retrace(const Trail& trail, const LegSettings& settings, PathJudge* changes);

  /// `failed` (kExhausted) when the trail never saw open water, or neither the trail nor any
  /// planned way can be swum.
  ///
  /// In unknown water (LegSettings::way_out_wait_s) what is in the way may go away, and no other
  /// way out is known: it looks along the trail for a while, then plans round what blocks it, back
  /// onto the trail and hardly higher than that, and so on for as long as it may.
  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }
  [[nodiscard]] bool needs_sight() const override { return !on_trail_; }
  [[nodiscard]] bool take_another_way() override { return cannot_look_ = true; }

 private:
  [[nodiscard]] bool has_stopped(const BehaviorInput& input) const;
  [[nodiscard]] Trail::Way way_along_trail(const Eigen::Vector3d& p_W) const;
  [[nodiscard]] double needed_m() const;
  void begin(const BehaviorInput& input);
  void give_up_trail(const char* why, const BehaviorInput& input);
  void give_up_if_blocked(PathJudge& changes, const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput follow(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput plan_out(const BehaviorInput& input);
  [[nodiscard]] bool is_patient() const { return settings_.way_out_wait_s > 0.0; }
  vehicle::Command& station(const Pose& X_WB);
  void look_back(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput wait(const BehaviorInput& input);
  void aim(const Eigen::Vector3d& p_W, LegSettings& settings, LegGoal& goal) const;
  void take_answer(const BehaviorInput& input);

  const Trail& trail_;
  PathJudge* changes_;
  LegSettings settings_;
  vehicle::Follower follower_;
  std::vector<Pose> way_;                            ///< Empty: there is none.
  Eigen::Vector3d out_W_ = Eigen::Vector3d::Zero();  ///< The end of the trail's way out.
  bool begun_ = false;                               ///< The way out was taken from the trail.
  double time_allowed_s_ = 0.0;
  std::optional<Utime> entered_at_;  ///< Of the way being followed.
  std::optional<vehicle::Command> station_;
  bool on_trail_ = true;      ///< `way_` is the trail's, not the planner's.
  bool planning_ = false;     ///< The trail was given up.
  bool cannot_look_ = false;  ///< Where the planned way leads.
  bool awaiting_plan_ = false;
  Utime asked_at_ = 0;
  const char* why_ = "";
  int tries_ = 0;
  int planned_ways_ = 0;
  std::optional<Eigen::Vector3d> planned_at_W_;  ///< Where the last planned way began.
  std::optional<Utime> blocked_since_;           ///< Without having got on since then.
  std::optional<Utime> looking_since_;
  int looks_ = 0;                               ///< In a row ...
  std::optional<Eigen::Vector3d> looked_at_W_;  ///< ... about here.
  int arrivals_ = 0;
  Progress progress_;
};

}  // namespace dive::behaviors
