#pragma once
// Attitude and depth autopilot at 50 Hz: from the command tuple and the measured state to
// pseudo-rates. What each loop does:
//
//   speed     open loop, for nothing on board measures it: a reference u_r follows the command with
//             a first-order lag, and the effort is what the vehicle's own drag and inertia need for
//             it, surge = (u_r |u_r| + coast_length * u_r') / full_speed^2
//   attitude  PD on the rotation vector of q_WB^-1 o, in B: no Euler angle, so no gimbal trouble;
//             the error counts up to the turn rate that the flippers can stop again
//   depth     PD on a reference that follows the command as fast as the vehicle can, with what
//             moving at that rate costs fed forward, and an integral bounded to the size of a trim
//             error. The vertical effort goes to heave as far as z of B points up, to surge
//             likewise while the vehicle hovers (under way the speed is the command's), and what
//             points along y, where the flippers cannot push, turns the nose up or down instead.
//             On its side hardly anything holds it: there surge is asked for as a speed beside the
//             commanded one, so that the vehicle is not led away faster than its reference knows

#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vehicle/command.h"

namespace dive::vehicle {

struct AutopilotOptions {
  Eigen::Vector3d attitude_p{6.0, 5.0, 7.0};  ///< Roll, pitch, yaw: effort per rad.
  Eigen::Vector3d attitude_d{3.0, 3.5, 3.3};  ///< Effort per rad/s.
  double max_turn_rate = 1.0;                 ///< rad/s, that an attitude error may ask for.
  double depth_p = 5.0;                       ///< Effort per m.
  double depth_d = 11.0;                      ///< Effort per m/s.
  double depth_i = 0.5;                       ///< Effort per m s.
  double depth_i_limit = 0.3;                 ///< Effort that the integral may reach.
  double depth_i_zone_m = 0.2;                ///< Further off than this, the integral rests.
  double depth_filter_s = 0.2;                ///< Time constant of the depth observer.
  double heave_share = 0.7;                   ///< Of full heave effort that the reference may need.
  double full_heave = 0.253;                  ///< m/s at full heave effort (steady, level, v = 0).
  double heave_brake = 0.06;                  ///< m/s^2, with which the reference comes to rest.
  double heave_lift = 0.447;                  ///< Lift at speed u: u w heave_lift beside w |w|.
  double heave_trim = 6.0;                    ///< Pitch effort that holds the nose, per u w.
  double nose_lift = 0.3;                     ///< rad of nose per vertical effort along y.
  double hover_speed = 0.2;                   ///< m/s below which surge may help with depth.
  double full_speed = 0.8;                    ///< m/s at full surge effort (steady, level).
  double coast_length_m = 2.06;               ///< Mass with entrained water over drag, m / (m/s)^2.
  double speed_time_constant_s = 1.0;         ///< Of the speed's reference.

  [[nodiscard]] std::string validate() const;
};

/// Steady heave (m/s, along z of B) under a heave effort in [-1, 1] at forward speed `speed` (m/s):
/// what the depth loop's model of the vehicle expects.
[[nodiscard]] double expected_heave(const AutopilotOptions& options, double effort, double speed);

/// Pure; allocates nothing.
class Autopilot {
 public:
  explicit Autopilot(AutopilotOptions options);

  /// `q_WB`, `omega_B` (rad/s) and `depth_m` are measured, `dt` is since the last call (s, > 0).
  [[nodiscard]] PseudoRates step(const Command& command, const Eigen::Quaterniond& q_WB,
                                 const Eigen::Vector3d& omega_B, double depth_m, double dt);
  /// Takes over a vehicle that swims at `speed`, m/s.
  void begin_at(double speed) { speed_reference_ = speed; }
  /// The part of the vertical effort that holds the vehicle's trim (buoyancy), in [-1, 1].
  [[nodiscard]] double trim_effort() const { return depth_integral_; }

 private:
  [[nodiscard]] double speed_effort(double speed, double dt);
  [[nodiscard]] double speed_of_push() const;
  [[nodiscard]] double heave_within_reach() const;
  void observe_depth(double commanded_depth, double depth_m, double dt);
  void track_depth(double commanded_depth, double climb, double dt);
  [[nodiscard]] double lift_effort(double heave, double dt);
  [[nodiscard]] Eigen::Vector3d turn_effort(const Eigen::Vector3d& error,
                                            const Eigen::Vector3d& omega_B) const;

  AutopilotOptions options_;
  double speed_reference_ = 0.0;
  double surge_for_depth_ = 0.0;  ///< m/s, beside the commanded speed.
  double depth_reference_ = 0.0;
  double depth_reference_rate_ = 0.0;
  double depth_ = 0.0;  ///< Observed, m, and its rate, m/s.
  double depth_rate_ = 0.0;
  double commanded_rate_ = 0.0;
  double last_command_ = 0.0;
  double depth_integral_ = 0.0;  ///< Effort.
  bool has_depth_ = false;
};

}  // namespace dive::vehicle
