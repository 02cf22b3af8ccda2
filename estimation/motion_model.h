#pragma once
// Expected speed through the water from the commanded speed and the measured turn rate: surge and
// sway of a hull with entrained water (Fossen 2011, ch. 6), divided by its masses so that only
// lengths and one ratio are left:
//
//   u_r' = (v - u_r) / T                     the autopilot's speed reference, with
//   |u_r |u_r| + L_x u_r'| <= v_full^2       no more than full effort
//   u_r = u while v = 0                      the gait stops the vehicle, not its reference
//   f'   = (u_r |u_r| + L_x u_r' - f) / T_f   the resulting thrust of the flippers
//   u'   = (f - u |u|) / L_x + v r / m
//   v'   = -m u r - v |v| / L_y - (|u| v - u x_t r) / L_t
//
// r is the yaw rate; v r / m and m u r couple surge and sway in a turn: the hull slips outwards, at
// 0.4 m/s by tens of degrees.

#include <string>

namespace dive::estimation {

/// Identified once per vehicle; these are the Aqua2's, from the mass of its URDF and the
/// hydrodynamic figures of the public Aqua simulators (Georgiades 2005).
struct MotionModel {
  double speed_time_constant_s = 1.0;  ///< T: equal to the autopilot's.
  double full_speed = 0.8;             ///< v_full, m/s: equal to the autopilot's.
  double thrust_lag_s = 0.14;          ///< T_f: lag of the motors and the sensors.
  double surge_coast_m = 2.06;         ///< L_x: mass over quadratic drag.
  double sway_coast_m = 0.745;         ///< L_y
  double tail_lift_m = 1.364;          ///< L_t: sway mass over the tail's added mass per length.
  double tail_m = 0.32;                ///< x_t: the tail, behind B's origin.
  double mass_ratio = 0.757;           ///< m: surge mass over sway mass.

  /// Empty if usable, else a sentence naming the value and its range.
  [[nodiscard]] std::string validate() const;
};

/// Speed through the water along x and y of B, m/s.
class ExpectedMotion {
 public:
  explicit ExpectedMotion(const MotionModel& model) : model_(model) {}

  /// Initialises a steady speed, m/s.
  void begin_at(double surge);
  /// `speed` is commanded (m/s), `yaw_rate` measured (rad/s), `dt` in s, at most 0.1.
  void advance(double speed, double yaw_rate, double dt);
  [[nodiscard]] double surge() const { return surge_; }
  [[nodiscard]] double sway() const { return sway_; }

 private:
  MotionModel model_;
  double reference_ = 0.0;  ///< u_r, m/s
  double thrust_ = 0.0;     ///< f, m^2/s^2
  double surge_ = 0.0;
  double sway_ = 0.0;
};

}  // namespace dive::estimation
