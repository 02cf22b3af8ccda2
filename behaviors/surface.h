#pragma once
// surface: straight up at a steady rate, until the depth sensor says so; without one as fast as it
// goes, for twice as long as it should take. The executive sees to it that there is open water
// above. In an unknown environment, where it may drift against something on its way up, it backs
// off first.

#include <optional>

#include "behaviors/back_off.h"
#include "behaviors/behavior.h"
#include "behaviors/drift_stop.h"

namespace dive::behaviors {

struct SurfaceOptions {
  double ascent_rate = 0.25;     ///< m/s
  double surfaced_depth = 0.25;  ///< m: shallower is surfaced.
  double clearance = 0.0;        ///< D_min of BackOff, m; 0: it does not back off.
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

  SurfaceOptions options_;
  BackOff back_off_;
  bool may_back_off_ = true;  ///< Before it begins to rise.
  std::optional<Utime> entered_at_;
  double entry_depth_ = 0.0;
  DriftStop drift_stop_;
  Progress progress_;
};

}  // namespace dive::behaviors
