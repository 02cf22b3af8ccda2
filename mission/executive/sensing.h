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

  /// False for a result of a scan that is not well-formed, not newer than the last accepted one, or
  /// of the future.
  [[nodiscard]] bool accept(Utime now, const planning::FreeAhead& free_ahead);
  [[nodiscard]] bool accept(Utime now, const planning::ObstacleAhead& obstacle);
  [[nodiscard]] bool accept(Utime now, const planning::PoseCorrection& correction);
  [[nodiscard]] bool accept(Utime now, const MapFix& fix);
  /// False if it is not well-formed, or of the future.
  [[nodiscard]] static bool accept(Utime now, const MapCorrection& correction);

  [[nodiscard]] const SensorStatus& status() const { return status_; }
  /// Last accepted sample; null before the first.
  [[nodiscard]] const ImuSample* imu() const { return imu_ ? &*imu_ : nullptr; }
  [[nodiscard]] bool has_depth() const { return depth_.has_value(); }

 private:
  std::optional<ImuSample> imu_;
  std::optional<DepthSample> depth_;
  Utime imu_received_ = 0;
  Utime depth_received_ = 0;
  std::optional<Utime> last_free_ahead_;  ///< Times of the last accepted scans.
  std::optional<Utime> last_obstacle_;
  std::optional<Utime> last_correction_;
  std::optional<Utime> last_fix_;
  SensorStatus status_;
};

}  // namespace dive::mission
