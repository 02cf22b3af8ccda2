#pragma once
// retrace: back along the breadcrumb trail to the last point with open water above. The way was
// swum once, so it is known to be free, unless the map has shown something in it since: then, and
// when the vehicle does not get on, a way out is planned, with less and less clearance. Done at
// once where nothing is overhead. Without attitude nothing can be swum: it waits, or goes up as
// soon as nothing is straight above.

#include <optional>
#include <vector>

#include "behaviors/behavior.h"
#include "behaviors/leg.h"
#include "behaviors/trail.h"
#include "vehicle/follower.h"

namespace dive::behaviors {

class Retrace final : public Behavior {
 public:
  /// The way out is taken from the trail as it is now; `open_above` says that there is open water
  /// above `p_W`, so that there is nothing to retrace. `changes` judges the trail against all that
  /// the map has shown since the dive began; null: nothing.
  Retrace(const Trail& trail, const Eigen::Vector3d& p_W, bool open_above,
          const LegSettings& settings, PathJudge* changes);

  /// `failed` (kExhausted) when the trail never saw open water, or neither the trail nor any
  /// planned way can be swum.
  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }

 private:
  void give_up_trail(const char* why);
  [[nodiscard]] BehaviorOutput follow(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput plan_out(const BehaviorInput& input);
  void take_answer(const BehaviorInput& input);

  LegSettings settings_;
  vehicle::Follower follower_;
  std::vector<Pose> way_;  ///< Empty: there is none.
  bool open_above_ = false;
  double time_allowed_s_ = 0.0;
  std::optional<Utime> entered_at_;  ///< Of the way being followed.
  std::optional<vehicle::Command> station_;
  bool planning_ = false;  ///< The trail was given up.
  bool awaiting_plan_ = false;
  Utime asked_at_ = 0;
  const char* why_ = "";
  int tries_ = 0;
  Progress progress_;
};

}  // namespace dive::behaviors
