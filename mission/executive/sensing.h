#pragma once
// First stage of a tick: decides which samples are accepted and which sensors are usable until the
// next tick. Private to mission/executive.

#include <optional>

#include "behaviors/monitors.h"
#include "common/measurements.h"
#include "mission/executive/io.h"
#include "mission/executive/localization.h"
#include "mission/executive/situation.h"

namespace dive::mission {

class Sensing {
 public:
  /// Passes samples that `monitors` accept to `localization`. A sensor that failsafes consider lost
  /// is not used even if it still sends, because a frozen sensor repeats its last value. Allocates
  /// nothing.
  void update(const StepInputs& inputs, behaviors::Monitors& monitors, Localization& localization);

  [[nodiscard]] const SensorStatus& status() const { return status_; }
  /// Last accepted sample; null before the first.
  [[nodiscard]] const ImuSample* imu() const { return imu_ ? &*imu_ : nullptr; }
  [[nodiscard]] bool has_depth() const { return depth_.has_value(); }

 private:
  std::optional<ImuSample> imu_;
  std::optional<DepthSample> depth_;
  Utime imu_received_ = 0;
  Utime depth_received_ = 0;
  SensorStatus status_;
};

}  // namespace dive::mission
