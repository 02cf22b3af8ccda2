#pragma once
// Attitude and depth autopilot at 50 Hz: from the command tuple and the measured state to
// pseudo-rates. Its loops:
//
//   speed     open loop, because no sensor measures it: a reference u_r follows the command with a
//             first-order lag, and the effort is what the vehicle's drag and inertia need for it,
//             surge = (u_r |u_r| + coast_length * u_r') / full_speed^2
//   attitude  PD on the rotation vector of q_WB^-1 o, in B: no Euler angles, so no gimbal lock; the
//             error is limited to the turn rate that the flippers can stop again; the righting
//             moment of weight and buoyancy is compensated (Fossen 2011, ch. 12.2)
//   depth     PD on a reference that follows the command as fast as the vehicle can, with a
//             feedforward for the effort of that rate and an integral bounded to the size of a trim
//             error. The vertical effort goes to heave by the vertical component of z of B and,
//             while hovering, to surge by that of x (under way the speed is the command's); its
//             component along y, where the flippers have no thrust, pitches the nose instead.
//             Heave under way turns the nose (Munk moment); where the flippers cannot balance that
//             for long, heave gives way to the attitude, because a nose that points along the path
//             climbs and one that does not leaves it.
//             On its side the vehicle has almost no vertical thrust: there surge is commanded as a
//             speed added to the commanded one, so that the speed reference includes it

#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/motion_model.h"
#include "vehicle/command.h"

namespace dive::vehicle {

struct AutopilotOptions {
  Eigen::Vector3d attitude_p{4.0, 5.0, 7.0};  ///< Roll, pitch, yaw: effort per rad.
  Eigen::Vector3d attitude_d{2.0, 3.5, 3.3};  ///< Effort per rad/s.
  /// Effort that balances the righting moment, roll at 90 degrees and pitch at 90 degrees.
  Eigen::Vector2d righting{0.66, 0.55};
  double max_turn_rate = 1.0;   ///< Turn-rate limit of the attitude loop, rad/s.
  double depth_p = 5.0;         ///< Effort per m.
  double depth_d = 11.0;        ///< Effort per m/s.
  double depth_i = 0.5;         ///< Effort per m s.
  double depth_i_limit = 0.3;   ///< Limit of the integral's effort.
  double depth_i_zone_m = 0.2;  ///< Depth error above which the integral is held.
  double depth_filter_s = 0.2;  ///< Time constant of the depth observer.
  double heave_share = 0.7;     ///< Fraction of full heave effort for the reference.
  double heave_brake = 0.06;    ///< Deceleration of the reference to rest, m/s^2.
  double heave_trim = 6.0;      ///< Pitch effort per u w that holds the nose.
  double give_way_s = 1.0;      ///< Time in which heave gives way to pitch, at least.
  double nose_lift = 0.3;       ///< Pitch, rad per vertical effort along y.
  double hover_speed = 0.2;     ///< m/s below which surge may help with depth.
  // Those of the vehicle's motion model:
  double full_heave =
      MotionModel{}.full_heave;  ///< m/s at full heave effort (steady, level, v = 0).
  /// Lift at speed u: u w heave_lift beside w |w|.
  double heave_lift = MotionModel{}.coast_m.z() / MotionModel{}.tail_lift_m.y();
  double full_speed = MotionModel{}.full_speed;  ///< m/s at full surge effort (steady, level).
  /// Mass with entrained water over drag, m / (m/s)^2.
  double coast_length_m = MotionModel{}.coast_m.x();
  /// Time constant of the speed reference.
  double speed_time_constant_s = MotionModel{}.speed_time_constant_s;

  [[nodiscard]] std::string validate() const;
};

/// The options for a vehicle with that motion model.
[[nodiscard]] AutopilotOptions autopilot_options(const MotionModel& motion);

/// Steady heave (m/s, along z of B) in the depth loop's model, under a heave effort in [-1, 1] at
/// forward speed `speed` (m/s).
[[nodiscard]] double expected_heave(const AutopilotOptions& options, double effort, double speed);

/// Turning effort about x, y and z of B that balances the righting moment; `up_B`: unit.
[[nodiscard]] Eigen::Vector3d righting_effort(const AutopilotOptions& options,
                                              const Eigen::Vector3d& up_B);

/// Deterministic in its inputs; does not allocate.
class Autopilot {
 public:
  explicit Autopilot(const AutopilotOptions& options);

  /// `q_WB`, `omega_B` (rad/s) and `depth_m` are measurements; `dt` is the time since the last call
  /// (s, > 0).
  [[nodiscard]] PseudoRates step(const Command& command, const Eigen::Quaterniond& q_WB,
                                 const Eigen::Vector3d& omega_B, double depth_m, double dt);
  /// Initialises the speed reference to the vehicle's `speed`, m/s.
  void begin_at(double speed) { speed_reference_ = speed; }
  /// The part of the vertical effort that compensates the vehicle's buoyancy (trim), in [-1, 1].
  [[nodiscard]] double trim_effort() const { return depth_integral_; }

 private:
  [[nodiscard]] double speed_effort(double speed, double dt);
  [[nodiscard]] double speed_of_push() const;
  [[nodiscard]] double heave_within_reach() const;
  void observe_depth(double commanded_depth, double depth_m, double pole, double dt);
  void track_depth(double commanded_depth, double climb, double gain, double dt);
  [[nodiscard]] double lift_effort(double heave, double dt);
  void give_way(double pitch, double lift, double dt);
  [[nodiscard]] Eigen::Vector3d turn_effort(const Eigen::Vector3d& error,
                                            const Eigen::Vector3d& omega_B) const;

  AutopilotOptions options_;
  double speed_reference_ = 0.0;
  double surge_for_depth_ = 0.0;  ///< Surge for depth beside the commanded speed, m/s.
  double depth_reference_ = 0.0;
  double depth_reference_rate_ = 0.0;
  double depth_ = 0.0;  ///< Observed depth, m, and its rate, m/s.
  double depth_rate_ = 0.0;
  double commanded_rate_ = 0.0;
  double last_command_ = 0.0;
  double depth_integral_ = 0.0;  ///< Effort of the integral.
  bool has_depth_ = false;
  double given_way_ = 0.0;  ///< Share of the heave that has given way to pitch, in [0, 1].
};

}  // namespace dive::vehicle
