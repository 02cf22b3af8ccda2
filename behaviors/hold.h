#pragma once
// hold: keep depth and heading for a given time.

#include <optional>

#include "behaviors/behavior.h"

namespace dive::behaviors {

class Hold final : public Behavior {
 public:
  explicit Hold(double duration_s);

  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }

 private:
  double duration_s_;
  std::optional<Utime> entered_at_;
  vehicle::Command station_;
  Progress progress_;
};

}  // namespace dive::behaviors
