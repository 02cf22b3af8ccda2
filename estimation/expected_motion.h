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
//
// Thrust over drag is known to a fifth. If v_full is wrong by a share s, so that f_u is wrong by 2
// s of it, the surge is wrong by s g, to first order:
//
//   g' = 2 (f_u - |u| g) / L_x
//
// In steady motion g = u, but a vehicle that brakes by its flippers brakes more, or less: g falls
// faster than u, and through zero.

#include <optional>

#include <Eigen/Core>

#include "common/motion_model.h"

namespace dive::estimation {

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
  /// Initialises the velocity (m/s) of a vehicle whose flippers give the thrust of steady
  /// `efforts` in surge and heave.
  void begin_at(const Eigen::Vector3d& v_B, const Eigen::Vector2d& efforts);
  /// Replaces the velocity through the water (m/s), and leaves the thrust as it is.
  void set_velocity(const Eigen::Vector3d& v_B);
  /// `omega_B`: turn rate, rad/s; `up_B`: unit; both of the interval's middle for second order in
  /// `dt` (s, at most 0.1).
  void advance(const Propulsion& propulsion, const Eigen::Vector3d& omega_B,
               const Eigen::Vector3d& up_B, double dt);
  /// Corrects the velocity by the measured rate of height (m/s) over `dt` (s).
  void correct(double height_rate, const Eigen::Vector3d& up_B, double dt);
  [[nodiscard]] const Eigen::Vector3d& v_B() const { return v_B_; }
  /// Change of v_B() per share s, m/s: (g, v, w), because v and w follow from u.
  [[nodiscard]] Eigen::Vector3d by_scale_B() const { return {surge_by_scale_, v_B_.y(), v_B_.z()}; }

 private:
  [[nodiscard]] double thrust_for(double speed, double dt);
  /// (u', v', w'), m/s^2; without thrust and drag of heave where its efforts are not known.
  [[nodiscard]] Eigen::Vector3d rate(const Eigen::Vector3d& v_B, const Eigen::Vector2d& thrust,
                                     const Eigen::Vector3d& omega_B, const Eigen::Vector3d& up_B,
                                     bool has_heave) const;

  MotionModel model_;
  double reference_ = 0.0;                         ///< u_r, m/s
  double surge_thrust_ = 0.0;                      ///< f_u, m^2/s^2
  double heave_thrust_ = 0.0;                      ///< f_w, m^2/s^2
  double surge_by_scale_ = 0.0;                    ///< g, m/s
  Eigen::Vector3d v_B_ = Eigen::Vector3d::Zero();  ///< m/s
};

}  // namespace dive::estimation
