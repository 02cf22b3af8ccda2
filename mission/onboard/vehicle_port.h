#pragma once
// What the loop on board needs of a vehicle: ticks, samples, and somewhere to send commands. There
// is one for the built-in simulator and one for vehicles over LCM.

#include <optional>
#include <vector>

#include "common/clock.h"
#include "common/measurements.h"
#include "common/range_scan.h"
#include "mission/executive/io.h"

namespace dive::mission {

/// Images of one moment from the two front cameras; either may be missing.
struct StereoPair {
  std::optional<ImageFrame> left;
  std::optional<ImageFrame> right;
};

/// Of each tick the functions are called in the order in which they stand here.
class VehiclePort {
 public:
  virtual ~VehiclePort() = default;

  /// Once, before the first tick, when the executive is ready: the time at which the dive begins.
  [[nodiscard]] virtual Utime begin() = 0;

  /// Waits for the next tick: its time, later than the one before. Nothing: the dive is over.
  [[nodiscard]] virtual std::optional<Utime> wait_for_tick() = 0;
  /// The samples of the tick, and an operator's command.
  virtual void sense(StepInputs& inputs) = 0;
  /// What planner, mapper and estimator have answered is among the inputs now: the last look at
  /// them before the step.
  virtual void amend(StepInputs& /*inputs*/) {}

  /// To the flippers.
  virtual void command(const StepOutputs& outputs) = 0;
  /// A range scan of this tick, measured at its stamp.
  [[nodiscard]] virtual std::optional<RangeScan> take_scan() = 0;
  /// The raw IMU samples since the last tick, oldest first.
  [[nodiscard]] virtual std::vector<ImuSample> take_imu_samples() = 0;
  [[nodiscard]] virtual StereoPair take_images() = 0;

  /// The tick is over.
  virtual void end_tick(const StepInputs& inputs, const StepOutputs& outputs) = 0;
};

}  // namespace dive::mission
