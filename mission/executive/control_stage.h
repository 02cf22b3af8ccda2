#pragma once
// Converts a command to flipper efforts by the measured attitude and depth; when one of them is
// lost, it controls the degrees of freedom that remain observable. Private to mission/executive.

#include <Eigen/Core>

#include "behaviors/drift_stop.h"
#include "common/measurements.h"
#include "vehicle/autopilot.h"
#include "vehicle/command.h"
#include "vehicle/predicted_attitude.h"

namespace dive::mission {

/// Inputs of the controller.
struct ControlMeasurements {
  const ImuSample* imu = nullptr;  ///< Last attitude sample.
  bool imu_is_fresh = false;       ///< True if the sample is of this tick.
  /// Measured depth, m; estimated while the sensor is lost.
  double depth_m = 0.0;
  bool depth_is_fresh = false;                    ///< True if the depth is measured.
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();  ///< Estimated velocity over ground, in B, m/s.
  double surge = 0.0;                             ///< Estimated speed through the water, m/s.
  /// Rotation about the vertical from the measured attitude to the published one, in whose frame
  /// commands are given, rad.
  double heading_correction = 0.0;
};

class ControlStage {
 public:
  explicit ControlStage(const vehicle::AutopilotOptions& options)
      : options_(options), autopilot_(options) {}

  /// Takes over a vehicle that swims at `speed`, m/s.
  void begin_at(double speed) { autopilot_.begin_at(speed); }
  /// Steady heave (m/s, along z of B) expected from the last efforts at `speed` (m/s).
  [[nodiscard]] double expected_heave(double speed) const;
  /// `dt`: s since the last step, > 0; requires `measured.imu`. Allocates nothing.
  void step(const vehicle::Command& command, const ControlMeasurements& measured, double dt);
  /// Attitude and turn rate predicted since the last attitude sample.
  [[nodiscard]] const vehicle::PredictedAttitude& predicted() const { return predicted_attitude_; }
  /// Last efforts; empty before the first step.
  [[nodiscard]] const vehicle::PseudoRates& rates() const { return rates_; }

 private:
  void steer_blindly(const vehicle::Command& command, const ControlMeasurements& measured,
                     double dt);

  vehicle::AutopilotOptions options_;
  vehicle::Autopilot autopilot_;
  vehicle::PredictedAttitude predicted_attitude_;
  /// Time of the attitude sample from which the prediction started, us.
  Utime predicted_from_ = -1;
  vehicle::PseudoRates rates_;
  behaviors::DriftStop drift_stop_;
};

}  // namespace dive::mission
