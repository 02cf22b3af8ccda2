#pragma once
// The fallback after a failure of the executive itself: a vertical ascent with only the autopilot,
// the last attitude and the last depth. It is separate and small, so that the defect that stopped
// the executive does not affect it.

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
  bool reported_ = false;
};

inline constexpr const char* kFallbackState = "dive.internal_error";

}  // namespace dive::mission
