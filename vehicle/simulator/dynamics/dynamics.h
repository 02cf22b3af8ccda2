#pragma once
// The equations of motion of a rigid body in water: Fossen 2011, "Handbook of Marine Craft
// Hydrodynamics and Motion Control", ch. 6 to 8, in Kirchhoff's momentum form.
//
//   M nu' + [w x p; w x l + v x p] = tau,   [p; l] = M nu,   M = M_RB + M_A
//
// nu = [v; w] is the velocity of B through the *water*, in B. A uniform current is an inertial
// frame of its own, so it enters only the integration of the position: p_W' = R v + current. tau:
// weight, buoyancy, quadratic drag, lift of the tail, flippers.

#include <array>

#include <Eigen/Cholesky>

#include "common/se3.h"
#include "vehicle/aqua2_figures.h"
#include "vehicle/model.h"

namespace dive::vehicle {

inline constexpr double kGravity = 9.81;  ///< m/s^2

/// Force of each flipper on its hip, in B, N; columns in the order of Model::hips_B.
using FlipperForces = Eigen::Matrix<double, 3, 6>;

class Dynamics {
 public:
  struct State {
    Pose X_WB;
    Eigen::Vector3d v = Eigen::Vector3d::Zero();      ///< Velocity through the water, in B, m/s.
    Eigen::Vector3d omega = Eigen::Vector3d::Zero();  ///< Angular velocity of B in W, in B, rad/s.
  };

  Dynamics(const Model& model, const Aqua2Figures& figures);

  /// One fourth-order Runge-Kutta step over `dt` (s) with constant forces.
  void advance(State& state, const FlipperForces& forces, const Eigen::Vector3d& current_W,
               double dt) const;

  /// [v'; w'] in the rotating axes of B.
  [[nodiscard]] Vector6d acceleration(const State& state, const FlipperForces& forces) const;

  /// Kinetic energy of body and entrained water, J.
  [[nodiscard]] double kinetic_energy(const State& state) const;

  /// Submerged fraction of the hull, [0, 1].
  [[nodiscard]] double submerged(const Pose& X_WB) const;

 private:
  static constexpr int kElements = 6;  ///< Elements of the hull's volume: three along, two abreast.

  [[nodiscard]] double submerged(double z, double height) const;
  [[nodiscard]] Vector6d weight_and_buoyancy(const Pose& X_WB) const;
  [[nodiscard]] Vector6d drag(const State& state) const;
  [[nodiscard]] Vector6d tail_lift(const State& state) const;
  [[nodiscard]] Vector6d flippers(const State& state, const FlipperForces& forces) const;

  Aqua2Figures figures_;
  FlipperForces hips_B_;
  double weight_ = 0.0;  ///< Weight, N.
  Eigen::Vector3d centre_of_mass_B_;
  double buoyancy_ = 0.0;  ///< Buoyancy when fully submerged, N.
  std::array<Eigen::Vector3d, kElements> elements_B_;
  Eigen::Vector3d linear_drag_;   ///< N per (m/s)^2.
  Eigen::Vector3d angular_drag_;  ///< N m per (rad/s)^2.
  double flipper_drag_ = 0.0;     ///< N per (m/s)^2, along z of B.
  Eigen::Vector3d tail_mass_;     ///< Added mass per length of the tail's section, kg/m.
  Matrix6d mass_;
  Matrix6d inverse_mass_;
};

}  // namespace dive::vehicle
