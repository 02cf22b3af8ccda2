#pragma once
// From a command to what the flippers are told: by the attitude and the depth that are heard, and,
// when one of them falls silent, with as much as can be done without. Private to mission/executive.

#include "common/measurements.h"
#include "vehicle/autopilot.h"
#include "vehicle/command.h"
#include "vehicle/reckoned_attitude.h"

namespace dive::mission {

/// What the helm steers by.
struct Heard {
  const ImuSample* imu = nullptr;  ///< The last one ...
  bool hears_imu = false;          ///< ... and whether that is now.
  double depth_m = 0.0;            ///< Measured, or as estimated ...
  bool hears_depth = false;        ///< ... while the sensor is silent.
};

class Helm {
 public:
  explicit Helm(const vehicle::AutopilotOptions& options)
      : options_(options), autopilot_(options) {}

  /// Takes over a vehicle that swims at `speed`, m/s.
  void begin_at(double speed) { autopilot_.begin_at(speed); }
  /// Steady heave (m/s, along z of B) that what was told last should make at `speed` (m/s).
  [[nodiscard]] double expected_heave(double speed) const;
  /// `dt`: s since the last step, > 0; `heard.imu` is there (demanded). Allocates nothing.
  void step(const vehicle::Command& command, const Heard& heard, double dt);
  /// Told last; nothing before the first step.
  [[nodiscard]] const vehicle::PseudoRates& rates() const { return rates_; }

 private:
  void steer_blindly(const vehicle::Command& command, const Heard& heard, double dt);

  vehicle::AutopilotOptions options_;
  vehicle::Autopilot autopilot_;
  vehicle::ReckonedAttitude reckoned_;
  vehicle::PseudoRates rates_;
};

}  // namespace dive::mission
