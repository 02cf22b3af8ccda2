#pragma once
// surface: straight up at a steady rate, until the depth sensor says so; without one as fast as it
// goes, for twice as long as it should take. The executive sees to it that there is open water
// above. In unknown water, where it is near to something that it may drift against on its way up,
// it first goes back to where there is room.

#include <optional>

#include "behaviors/back_off.h"
#include "behaviors/behavior.h"

namespace dive::behaviors {

struct SurfaceOptions {
  double ascent_rate = 0.25;     ///< m/s
  double surfaced_depth = 0.25;  ///< m: shallower is surfaced.
  double room = 0.0;             ///< m that it likes to have around it; see BackOff.
};

class Surface final : public Behavior {
 public:
  explicit Surface(SurfaceOptions options = {});

  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }
  [[nodiscard]] bool rises() const override { return !back_off_.is_under_way(); }

 private:
  [[nodiscard]] std::optional<vehicle::Command> make_room(const BehaviorInput& input);

  SurfaceOptions options_;
  BackOff back_off_;
  bool may_make_room_ = true;  ///< Before it begins to rise.
  std::optional<Utime> entered_at_;
  double entry_depth_ = 0.0;
  double yaw_ = 0.0;
  Progress progress_;
};

}  // namespace dive::behaviors
