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

/// Of D_min: so near to the trail all is as free as on it, so that it may be left out what lies
/// between two places of it that are no further apart.
inline constexpr double kTrailLinkShare = 0.8;

class Retrace final : public Behavior {
 public:
  /// Keeps a reference to the trail. `changes` judges it against all that the map has shown since
  /// the dive began; null: nothing.
  Retrace(const Trail& trail, const LegSettings& settings, PathJudge* changes);

  /// `failed` (kExhausted) when the trail never saw open water, or neither the trail nor any
  /// planned way can be swum.
  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }
  [[nodiscard]] bool needs_sight() const override { return !on_trail_; }

 private:
  [[nodiscard]] bool has_stopped(const BehaviorInput& input) const;
  void begin(const BehaviorInput& input);
  void give_up_trail(const char* why, const Eigen::Vector3d& p_W);
  [[nodiscard]] BehaviorOutput follow(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput plan_out(const BehaviorInput& input);
  void take_answer(const BehaviorInput& input);

  const Trail& trail_;
  PathJudge* changes_;
  LegSettings settings_;
  vehicle::Follower follower_;
  std::vector<Pose> way_;  ///< Empty: there is none.
  bool begun_ = false;     ///< The way out was taken from the trail.
  double time_allowed_s_ = 0.0;
  std::optional<Utime> entered_at_;  ///< Of the way being followed.
  std::optional<vehicle::Command> station_;
  bool on_trail_ = true;   ///< `way_` is the trail's, not the planner's.
  bool planning_ = false;  ///< The trail was given up.
  bool awaiting_plan_ = false;
  Utime asked_at_ = 0;
  const char* why_ = "";
  int tries_ = 0;
  int planned_ways_ = 0;
  std::optional<Eigen::Vector3d> planned_at_W_;  ///< Where the last planned way began.
  int arrivals_ = 0;
  Progress progress_;
};

}  // namespace dive::behaviors
