#pragma once
// surface: straight up at a steady rate, until the depth sensor says so; without one as fast as it
// goes, for twice as long as it should take. The executive sees to it that there is open water
// above.

#include <optional>

#include "behaviors/behavior.h"

namespace dive::behaviors {

struct SurfaceOptions {
  double ascent_rate = 0.25;     ///< m/s
  double surfaced_depth = 0.25;  ///< m: shallower is surfaced.
};

class Surface final : public Behavior {
 public:
  explicit Surface(SurfaceOptions options = {});

  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }

 private:
  SurfaceOptions options_;
  std::optional<Utime> entered_at_;
  double entry_depth_ = 0.0;
  double yaw_ = 0.0;
  Progress progress_;
};

}  // namespace dive::behaviors
