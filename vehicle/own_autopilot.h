#pragma once
// The autopilot of a vehicle that its executive does not steer: in the vehicle itself, in the
// executive's fallback, and in the supervisor, which computes with it the efforts that the vehicle
// makes for its commands.

#include <optional>

#include "common/clock.h"
#include "common/measurements.h"
#include "vehicle/autopilot.h"
#include "vehicle/command.h"

namespace dive::vehicle {

/// Deterministic; does not allocate.
class OwnAutopilot {
 public:
  explicit OwnAutopilot(const AutopilotOptions& options = {}) : autopilot_(options) {}

  /// The newest samples.
  void observe(const std::optional<ImuSample>& imu, const std::optional<DepthSample>& depth);
  /// From `now` on another process gives the efforts.
  void release(Utime now);
  /// The efforts from `now` on; none until both sensors have been received. `command`: in the
  /// compass's frame. `surge`: speed through the water (m/s), from which a vehicle brakes that is
  /// taken over or told to stop.
  [[nodiscard]] PseudoRates step(const Command& command, double surge, Utime now);

 private:
  Autopilot autopilot_;
  std::optional<ImuSample> imu_;
  std::optional<DepthSample> depth_;
  PseudoRates rates_;    ///< Its last efforts.
  bool steers_ = false;  ///< The last efforts were its own.
  std::optional<Utime> last_;
};

}  // namespace dive::vehicle
