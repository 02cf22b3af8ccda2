#pragma once
// Figures of the real vehicle that its URDF does not contain: hydrodynamics and thrust. They have
// three sources, marked below: the public Aqua simulators of McGill's Mobile Robotics Lab (2016 and
// 2019), which credit C. Georgiades' M.Eng. thesis "Simulation and control of an underwater hexapod
// robot" (McGill, 2005) for the hydrodynamics and Georgiades, Giguere (2006) and Plamondon & Nahon
// (2009) for the thrust; theory; and our own choice.

#include <cmath>

#include <Eigen/Core>

#include "common/se3.h"

namespace dive::vehicle {

struct Aqua2Figures {
  // --- From the public Aqua simulators ---

  double water_density = 999.97;                 ///< kg/m^3.
  Eigen::Vector3d shell_size{0.64, 0.21, 0.12};  ///< m; frontal areas and moment arms of the drag.
  /// Diagonal: kg, kg, kg, kg m^2, kg m^2, kg m^2 along and about x, y, z of B.
  Vector6d added_mass{6.98, 14.5, 32.41, 0.4, 1.19, 0.55};
  Eigen::Vector3d body_drag{0.9, 1.08, 1.28};  ///< Drag coefficients across the shell's faces.
  double flipper_drag = 1.12;                  ///< Drag coefficient of a flipper across its plane.
  double flipper_length = 0.16;                ///< m.
  double flipper_width = 0.05;                 ///< m.
  double thrust_coefficient = 5.0 * 0.1963;    ///< Coefficient of the law in flipper_thrust().

  // --- Derived: slender-body theory (Lighthill 1960) of a body with a blunt, full-width tail ---

  /// Fraction of the tail's theoretical lift that is present: 1 is the theory; 0 leaves the bare
  /// Munk moment, under which a hull this flat could not hold its attitude at full speed.
  double tail_lift = 1.0;

  // --- Our own choice ---

  double gait_frequency = 2.0;        ///< Hz, constant; the amplitude sets the thrust.
  double max_amplitude = 0.785;       ///< rad; 45 degrees to either side.
  double surge_amplitude = 0.466;     ///< rad, all flippers: full surge gives 0.8 m/s.
  double heave_amplitude = 0.466;     ///< rad, all flippers.
  double roll_amplitude = 0.45;       ///< rad, all flippers: 1.5 times the righting moment.
  double pitch_amplitude = 0.55;      ///< rad, front and rear flippers.
  double yaw_amplitude = 0.5;         ///< rad, all flippers.
  double motor_lag_s = 0.12;          ///< First-order lag: half a beat of the gait is 0.25 s.
  double metacentric_height = 0.005;  ///< m, centre of buoyancy above the centre of mass.
  double spare_buoyancy_kg = 0.05;    ///< Net buoyancy, kg: a dead vehicle rises.
  double hotel_load_w = 25.0;         ///< Power of computers, cameras and motors at rest.
  double thrust_power = 5.6;          ///< W/N^1.5 per flipper: 45 W at full surge.
  /// Power to hold depth and attitude under way, beside steady thrust: simulated dives use 1 W in
  /// open water and 9 W inside a wreck.
  double steering_power_w = 7.0;

  /// Cycle-averaged force of one flipper beating with `amplitude` (rad), N.
  [[nodiscard]] double flipper_thrust(double amplitude) const {
    const double swept =
        (flipper_width + 2.0 * 1.05 * flipper_width) * flipper_length * flipper_length / 3.0;
    return thrust_coefficient * swept * water_density * amplitude * gait_frequency;
  }

  /// Electrical power, W, for level swimming at a fraction of the speed at full surge: drag, and so
  /// thrust, is proportional to the square of the speed.
  [[nodiscard]] double cruise_power_w(double speed_fraction) const {
    return swimming_power_w(surge_amplitude, speed_fraction);
  }
  /// The same for a level ascent or descent at a fraction of the speed at full heave.
  [[nodiscard]] double heave_power_w(double speed_fraction) const {
    return swimming_power_w(heave_amplitude, speed_fraction);
  }

 private:
  [[nodiscard]] double swimming_power_w(double amplitude, double speed_fraction) const {
    const double thrust = flipper_thrust(amplitude) * speed_fraction * speed_fraction;
    return hotel_load_w + steering_power_w + 6.0 * thrust_power * thrust * std::sqrt(thrust);
  }
};

}  // namespace dive::vehicle
