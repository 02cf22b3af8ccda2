#pragma once
// The vehicle as the loop on board uses it: ticks, samples and commands. One implementation for the
// built-in simulator, one for vehicles over LCM.

#include <optional>
#include <vector>

#include "common/clock.h"
#include "common/measurements.h"
#include "common/range_scan.h"
#include "mission/executive/io.h"
#include "planning/world/observed_map.h"
#include "vehicle/exit_path.h"

namespace dive::mission {

/// Images of one moment from the two front cameras; either may be missing.
struct StereoPair {
  std::optional<ImageFrame> left;
  std::optional<ImageFrame> right;
};

/// In each tick the functions are called in this order.
class VehiclePort {
 public:
  virtual ~VehiclePort() = default;

  /// Called once, before the first tick, when the executive is ready; returns the dive's start
  /// time.
  [[nodiscard]] virtual Utime begin() = 0;

  /// Waits for the next tick and returns its time, later than the last; empty when the dive is
  /// over.
  [[nodiscard]] virtual std::optional<Utime> wait_for_tick() = 0;
  /// Adds the samples of the tick, and an operator's command.
  virtual void sense(StepInputs& inputs) = 0;
  /// Last change of the inputs before the step; the answers of planner, mapper and estimator are
  /// among them.
  virtual void amend(StepInputs& /*inputs*/) {}

  /// Sends the efforts to the flippers.
  virtual void command(const StepOutputs& outputs) = 0;
  /// How the vehicle leaves its present place if no further command arrives, and the obstacles
  /// observed so far.
  virtual void keep_exit_path(const vehicle::ExitPath& /*path*/,
                              const planning::ObservedMap& /*observed*/) {}
  /// A range scan that arrived in this tick, measured at its own time.
  [[nodiscard]] virtual std::optional<RangeScan> take_scan() = 0;
  /// The raw IMU samples since the last tick, oldest first.
  [[nodiscard]] virtual std::vector<ImuSample> take_imu_samples() = 0;
  [[nodiscard]] virtual StereoPair take_images() = 0;

  /// Called at the end of the tick.
  virtual void end_tick(const StepInputs& inputs, const StepOutputs& outputs) = 0;
};

}  // namespace dive::mission
