#pragma once
// The attitude of a vehicle whose attitude sensor has fallen silent, for the few seconds in which a
// model of its turning is worth anything: long enough to stop a turn and to come level.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vehicle/command.h"

namespace dive::vehicle {

/// omega' = gain * effort, q' = q omega: drag and righting moment are small beside the flippers.
class ReckonedAttitude {
 public:
  /// rad/s^2 per turning effort of 1 about x, y and z of B, of the aqua2.
  static constexpr double kGain[3] = {1.25, 0.75, 1.2};
  static constexpr double kTrusted = 4.0;  ///< s

  /// The last that was measured: q_WB and omega_B (rad/s).
  void start(const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& omega_B);
  /// What the flippers were told for the last `dt` s.
  void advance(const PseudoRates& rates, double dt);

  /// False from kTrusted on: then nothing is known but that the vehicle rights itself.
  [[nodiscard]] bool is_trusted() const { return age_s_ < kTrusted; }
  [[nodiscard]] const Eigen::Quaterniond& q_WB() const { return q_WB_; }
  [[nodiscard]] const Eigen::Vector3d& omega_B() const { return omega_B_; }
  /// Angle (rad) between z of B and up.
  [[nodiscard]] double tilt() const;

 private:
  Eigen::Quaterniond q_WB_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d omega_B_ = Eigen::Vector3d::Zero();
  double age_s_ = 0.0;
};

}  // namespace dive::vehicle
