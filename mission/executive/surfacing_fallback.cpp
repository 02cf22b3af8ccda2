#include "mission/executive/surfacing_fallback.h"

#include "behaviors/behavior.h"
#include "behaviors/failsafes.h"
#include "behaviors/monitors.h"

namespace dive::mission {

StepOutputs SurfacingFallback::step(const StepInputs& inputs, const std::string& reason) {
  StepOutputs outputs;
  if (inputs.imu && behaviors::is_plausible(*inputs.imu)) {
    if (!imu_) yaw_ = to_rpy(inputs.imu->q_WB).z();
    imu_ = inputs.imu;
  }
  if (inputs.depth && behaviors::is_plausible(*inputs.depth)) depth_ = inputs.depth;
  if (!reported_) {
    constexpr auto kind = behaviors::FailsafeKind::kInternalError;
    reported_ = true;
    outputs.failsafes.push_back({behaviors::to_string(behaviors::Rung::kEmergencySurface),
                                 std::string(behaviors::to_string(kind)),
                                 {},
                                 reason});
    outputs.transitions.push_back({"", kFallbackState, "", reason, ""});
  }
  outputs.command = behaviors::station_keeping(0.0, yaw_);
  const double dt = last_ ? to_seconds(inputs.now - *last_) : 0.0;
  if (imu_ && depth_ && dt > 0.0) {
    outputs.rates = autopilot_.step(outputs.command, imu_->q_WB, imu_->gyro_B, depth_->depth_m, dt);
  }
  last_ = inputs.now;
  outputs.status.state = kFallbackState;
  outputs.status.rung = behaviors::to_string(behaviors::Rung::kEmergencySurface);
  outputs.status.depth_m = depth_ ? depth_->depth_m : 0.0;
  return outputs;
}

}  // namespace dive::mission
