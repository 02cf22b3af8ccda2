#pragma once
// The coefficients of a vehicle's motion through the water, held by its description (the URDF's
// <motion>, vehicle/motion_element.h) and identified by `dive fit`. The equations that they belong
// to are in estimation/expected_motion.h. The values here are the Aqua2's, and the only copy: they
// apply to a description without <motion>.

#include <span>
#include <string>

#include <Eigen/Core>

namespace dive {

/// From the mass of the Aqua2's URDF and the hydrodynamic figures of the public Aqua simulators
/// (Georgiades 2005).
struct MotionModel {
  double speed_time_constant_s = 1.0;  ///< T: of the autopilot's speed reference.
  double full_speed = 0.8;             ///< v_full: steady speed at full surge effort, level, m/s.
  double full_heave = 0.253;           ///< Steady heave at full heave effort, level, v = 0, m/s.
  double thrust_lag_s = 0.14;          ///< T_f: lag of the motors and the sensors.
  /// L: mass over quadratic drag, of surge, sway and heave.
  Eigen::Vector3d coast_m{2.06, 0.745, 0.428};
  double sway_mass_ratio = 0.757;   ///< mu_y: surge mass over sway mass, entrained water included.
  double heave_mass_ratio = 0.475;  ///< mu_z: surge mass over heave mass.
  /// T: mass over the tail's added mass per length, of sway and heave.
  Eigen::Vector2d tail_lift_m{1.364, 0.957};
  double tail_m = 0.32;      ///< x_t: the tail, behind B's origin.
  double buoyancy = 0.0213;  ///< b: net buoyancy over surge mass, m/s^2.

  /// What the equations get wrong, for some seconds: one sigma along x, y and z of B, m/s.
  Eigen::Vector3d slip_sigma{0.03, 0.03, 0.03};
  double slip_time_s = 10.0;  ///< Correlation time of that.

  /// Empty if usable, else a sentence naming the value and its range.
  [[nodiscard]] std::string validate() const;
};

/// One number of a MotionModel.
struct MotionCoefficient {
  const char* name;     ///< As in the vehicle's description.
  const char* unit;     ///< Empty: none.
  const char* meaning;  ///< A noun phrase.
  double low;           ///< Least plausible value.
  double high;          ///< Greatest plausible value.
  double& (*of)(MotionModel&);

  [[nodiscard]] double value(MotionModel model) const { return of(model); }
};

/// Number of coefficients of the equations: those that a fit identifies. They come first in
/// motion_coefficients().
inline constexpr std::size_t kEquationCoefficients = 12;

/// All numbers of a MotionModel, in a fixed order.
[[nodiscard]] std::span<const MotionCoefficient> motion_coefficients();

}  // namespace dive
