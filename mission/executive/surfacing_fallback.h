#pragma once
// The fallback after a failure of the executive itself: the vehicle follows the exit path of the
// last good tick, then ascends, with only the autopilot, attitude and depth. It is separate and
// small, so that the defect that stopped the executive does not affect it.

#include <optional>
#include <string>

#include "mission/executive/io.h"
#include "vehicle/exit_guidance.h"
#include "vehicle/own_autopilot.h"

namespace dive::mission {

class SurfacingFallback {
 public:
  explicit SurfacingFallback(const MotionModel& motion)
      : autopilot_(vehicle::autopilot_options(motion)), guidance_(motion) {
    path_.waypoints.reserve(vehicle::kMaxExitWaypoints);  // keep() allocates nothing
  }

  /// After every good tick. Allocates nothing.
  void keep(const vehicle::ExitPath& path) { path_ = path; }

  /// One control tick; `reason` is recorded with the first.
  [[nodiscard]] StepOutputs step(const StepInputs& inputs, const std::string& reason);
  /// True when the vehicle is at the surface, or presumed to be without a depth sensor.
  [[nodiscard]] bool is_done() const { return is_done_; }

 private:
  void record(StepOutputs& outputs, const std::string& reason);

  vehicle::OwnAutopilot autopilot_;
  vehicle::ExitGuidance guidance_;
  vehicle::ExitPath path_;
  vehicle::PseudoRates rates_;     ///< Last efforts.
  std::optional<double> depth_m_;  ///< Last measured depth.
  std::optional<Utime> last_;
  bool is_done_ = false;
};

inline constexpr const char* kFallbackState = "dive.internal_error";

}  // namespace dive::mission
