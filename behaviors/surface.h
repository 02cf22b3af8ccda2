#pragma once
// surface: a vertical ascent at a steady rate until the depth sensor reports the surface; without
// depth samples as fast as possible, for twice the time that it should take. The executive ensures
// open water above. While the position is known, as it is beside what fixes come from, the vehicle
// swims back to the place where it began to rise: a minute's drift with a slow current would take
// it out of a hatch and against what stands beside it. In an unknown environment, where the vehicle
// may drift against an obstacle while it rises, it backs off first.

#include <optional>

#include "behaviors/back_off.h"
#include "behaviors/behavior.h"
#include "behaviors/drift_stop.h"
#include "vehicle/ascent_rates.h"
#include "vehicle/going_home.h"

namespace dive::behaviors {

struct SurfaceOptions {
  double ascent_rate = vehicle::kCommandedAscentRate;  ///< m/s
  double surfaced_depth = vehicle::kSurfacedDepth;     ///< m
  double clearance = 0.0;  ///< D_min of BackOff, m; 0: it does not back off.
  BackOffOptions back_off = {};
};

class Surface final : public Behavior {
 public:
  explicit Surface(SurfaceOptions options = {});

  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }
  [[nodiscard]] bool rises() const override { return !back_off_.is_under_way(); }

 private:
  [[nodiscard]] std::optional<vehicle::Command> back_off(const BehaviorInput& input);
  void keep_place(const BehaviorInput& input, vehicle::Command& command);

  SurfaceOptions options_;
  BackOff back_off_;
  bool may_back_off_ = true;  ///< True before the ascent starts.
  std::optional<Utime> entered_at_;
  double entry_depth_ = 0.0;
  std::optional<Eigen::Vector2d> place_W_;  ///< Where it has come to rest, m.
  DriftStop drift_stop_;
  Progress progress_;
};

}  // namespace dive::behaviors
