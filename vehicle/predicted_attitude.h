#pragma once
// The predicted attitude of a vehicle without attitude measurements, for the few seconds in which a
// model of its rotation is useful: long enough to stop a turn and to level out.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vehicle/command.h"

namespace dive::vehicle {

/// omega' = gain * (effort - righting) - drag |omega| omega, q' = q omega, with `righting` the
/// effort that would balance the righting moment (AutopilotOptions).
class PredictedAttitude {
 public:
  /// rad/s^2 per turning effort of 1 about x, y and z of B, of the aqua2.
  static constexpr double kGain[3] = {1.87, 0.75, 1.2};
  /// 1/rad, about x, y and z of B, of the aqua2: drag of hull (strip by strip) and flippers, over
  /// the inertia with entrained water.
  static constexpr double kDrag[3] = {0.33, 0.63, 0.35};
  static constexpr double kTrusted = 4.0;  ///< Validity of the prediction, s.

  /// Starts from the last measurement: q_WB and omega_B (rad/s).
  void start(const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& omega_B);
  /// Propagates by `dt` s under the pseudo-rates commanded in that time.
  void advance(const PseudoRates& rates, double dt);

  /// False from kTrusted on: then the only certainty is that the vehicle rights itself.
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
