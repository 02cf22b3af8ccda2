#include "mission/executive/surfacing_fallback.h"

#include <algorithm>

#include "behaviors/failsafes.h"
#include "behaviors/monitors.h"

namespace dive::mission {

StepOutputs SurfacingFallback::step(const StepInputs& inputs, const std::string& reason) {
  StepOutputs outputs;
  std::optional<ImuSample> imu;
  std::optional<DepthSample> depth;
  if (inputs.imu && behaviors::is_plausible(*inputs.imu)) imu = inputs.imu;
  if (inputs.depth && behaviors::is_plausible(*inputs.depth)) depth = inputs.depth;
  if (depth) depth_m_ = depth->depth_m;
  const bool is_first = !last_;
  // A failed tick may have had an earlier time than the last.
  const Utime now = is_first ? inputs.now : std::max(*last_, inputs.now);
  last_ = now;
  guidance_.observe(imu, depth, rates_, now);
  autopilot_.observe(imu, depth);
  if (is_first) {
    record(outputs, reason);
    guidance_.set_exit_path(path_);
    guidance_.begin(now, /*may_hold=*/false);
  }
  outputs.command = guidance_.step(now);
  outputs.rates = rates_ = autopilot_.step(outputs.command, guidance_.surge(), now);
  is_done_ = guidance_.has_surfaced(now) || guidance_.is_presumed_surfaced(now);
  outputs.status.state = kFallbackState;
  outputs.status.rung = behaviors::to_string(behaviors::Rung::kEmergencySurface);
  outputs.status.depth_m = depth_m_.value_or(0.0);
  outputs.status.finished = is_done_;
  return outputs;
}

void SurfacingFallback::record(StepOutputs& outputs, const std::string& reason) {
  constexpr auto kind = behaviors::FailsafeKind::kInternalError;
  outputs.failsafes.push_back({behaviors::to_string(behaviors::Rung::kEmergencySurface),
                               std::string(behaviors::to_string(kind)),
                               {},
                               reason});
  outputs.transitions.push_back({"", kFallbackState, "", reason, ""});
}

}  // namespace dive::mission
