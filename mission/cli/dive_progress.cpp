#include "mission/cli/dive_progress.h"

#include <fmt/format.h>

namespace dive::mission {

void DiveProgress::observe(const StepInputs& inputs, const StepOutputs& outputs) {
  if (inputs.now < next_) return;
  next_ = inputs.now + (line_.on_terminal() ? 1 : 10) * kMicrosecondsPerSecond;
  const Status& status = outputs.status;
  const std::string goal = status.goal.empty() ? "" : " -> " + status.goal;
  const std::string clearance =
      status.clearance_m > 0.0 ? fmt::format("{:.2f} m", status.clearance_m) : "-";
  const bool sees = outputs.estimate.source == estimation::EstimatorKind::kVisualInertial;
  line_.show(
      fmt::format("{:6.1f} s  {:<28} to go {:5.1f} m {:4.0f} s  depth {:4.1f} m  "
                  "clearance {}{}{}",
                  to_seconds(inputs.now), status.state + goal, status.distance_to_go_m,
                  status.time_to_go_s, status.depth_m, clearance, sees ? "  visual-inertial" : "",
                  status.rung == "none" ? "" : "  [" + status.rung + "]"));
}

}  // namespace dive::mission
