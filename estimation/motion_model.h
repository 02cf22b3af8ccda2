#pragma once
// Expected velocity through the water from what drives the vehicle and how it turns: the
// translation of a hull with entrained water (Kirchhoff's equations: Fossen 2011, ch. 6), divided
// by its masses so that only lengths and ratios are left. With v = (u, v, w) the velocity in B,
// (p, q, r) the turn rates, k the direction up in B and mu_y, mu_z the surge mass over those of
// sway and heave:
//
//   u' = (f_u - u |u|) / L_x + v r / mu_y - w q / mu_z + b k_x
//   v' = w p mu_y / mu_z - mu_y u r - v |v| / L_y - |u| (v - r x_t s) / T_y + mu_y b k_y
//   w' = mu_z u q - v p mu_z / mu_y + (f_w - w |w|) / L_z - |u| (w + q x_t s) / T_z + mu_z b k_z
//
// s is the sign of u: the tail is where the water leaves. A turn exchanges momentum between the
// axes: a hull that heaves and pitches shoots ahead, and one that yaws slips outwards, at 0.4 m/s
// by tens of degrees. f_u and f_w are the thrust over drag of the flippers, with a lag T_f: by
// their efforts, or, where only the commanded speed is known, what the autopilot needs for it,
//
//   u_r' = (v_c - u_r) / T          u_r = u while v_c = 0
//   f_u = u_r |u_r| + L_x u_r'      within +-v_full^2
//
// and in heave what holds the depth. The measured rate of height z' corrects the velocity along k:
// v += W k (z' - k.v) dt / (k.W k t_z), with W the relative variances of the three axes: on its
// side it corrects the sway.

#include <optional>
#include <string>

#include <Eigen/Core>

namespace dive::estimation {

/// Identified once per vehicle; these are the Aqua2's, from the mass of its URDF and the
/// hydrodynamic figures of the public Aqua simulators (Georgiades 2005).
struct MotionModel {
  double speed_time_constant_s = 1.0;  ///< T: equal to the autopilot's.
  double full_speed = 0.8;             ///< v_full, m/s: equal to the autopilot's.
  double full_heave = 0.253;   ///< m/s at full heave effort, level: equal to the autopilot's.
  double thrust_lag_s = 0.14;  ///< T_f: lag of the motors and the sensors.
  /// L: mass over quadratic drag, of surge, sway and heave.
  Eigen::Vector3d coast_m{2.06, 0.745, 0.428};
  double sway_mass_ratio = 0.757;   ///< mu_y
  double heave_mass_ratio = 0.475;  ///< mu_z
  /// T: mass over the tail's added mass per length, of sway and heave.
  Eigen::Vector2d tail_lift_m{1.364, 0.957};
  double tail_m = 0.32;      ///< x_t: the tail, behind B's origin.
  double buoyancy = 0.0213;  ///< b: net buoyancy over surge mass, m/s^2.

  /// Empty if usable, else a sentence naming the value and its range.
  [[nodiscard]] std::string validate() const;
};

/// What drives the vehicle.
struct Propulsion {
  double speed = 0.0;  ///< Commanded, m/s.
  /// Efforts of the flippers in surge and heave, each in [-1, 1]; unknown if absent.
  std::optional<Eigen::Vector2d> efforts = {};
};

/// Expected velocity through the water, in B.
class ExpectedMotion {
 public:
  explicit ExpectedMotion(const MotionModel& model) : model_(model) {}

  /// Initialises a steady speed, m/s.
  void begin_at(double surge);
  /// Replaces the velocity through the water (m/s), and leaves the thrust as it is.
  void set_velocity(const Eigen::Vector3d& v_B);
  /// `omega_B`: turn rate, rad/s; `up_B`: unit; `dt` in s, at most 0.1.
  void advance(const Propulsion& propulsion, const Eigen::Vector3d& omega_B,
               const Eigen::Vector3d& up_B, double dt);
  /// Corrects the velocity by the measured rate of height (m/s) over `dt` (s).
  void correct(double height_rate, const Eigen::Vector3d& up_B, double dt);
  [[nodiscard]] const Eigen::Vector3d& v_B() const { return v_B_; }

 private:
  [[nodiscard]] double thrust_for(double speed, double dt);

  MotionModel model_;
  double reference_ = 0.0;                         ///< u_r, m/s
  double surge_thrust_ = 0.0;                      ///< f_u, m^2/s^2
  double heave_thrust_ = 0.0;                      ///< f_w, m^2/s^2
  Eigen::Vector3d v_B_ = Eigen::Vector3d::Zero();  ///< m/s
};

}  // namespace dive::estimation
