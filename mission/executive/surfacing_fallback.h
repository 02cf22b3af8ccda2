#pragma once
// What is left when the executive itself has failed: straight up, with nothing but the autopilot,
// the last attitude and the last depth. Kept apart and small, so that what broke the executive does
// not break this.

#include <optional>
#include <string>

#include "mission/executive/io.h"
#include "vehicle/autopilot.h"

namespace dive::mission {

class SurfacingFallback {
 public:
  explicit SurfacingFallback(const vehicle::AutopilotOptions& options) : autopilot_(options) {}

  /// One control tick; `reason` is recorded with the first.
  [[nodiscard]] StepOutputs step(const StepInputs& inputs, const std::string& reason);

 private:
  vehicle::Autopilot autopilot_;
  std::optional<ImuSample> imu_;
  std::optional<DepthSample> depth_;
  std::optional<Utime> last_;
  double yaw_ = 0.0;
  bool told_ = false;
};

inline constexpr const char* kFallbackState = "dive.internal_error";

}  // namespace dive::mission
