#pragma once
// From pseudo-rates to the force of each flipper.
//
// A flipper beats about an offset angle, which sets the direction of its mean force in the x-z
// plane of B, with an amplitude, which sets its magnitude. The allocation is linear in the
// pseudo-rates, for a hip at (x, y):
//
//   f_x = T(surge) surge - sign(y) T(yaw) yaw
//   f_z = T(heave) heave + sign(y) T(roll) roll - end(x) T(pitch) pitch
//
// with T the thrust at the amplitude for one unit of the rate, and end(x) = +1 for the front, -1
// for the rear and 0 for the middle pair. Where the sum exceeds the largest amplitude, the flipper
// keeps the direction and saturates. Force follows demand with a first-order lag.

#include "vehicle/aqua2_figures.h"
#include "vehicle/command.h"
#include "vehicle/simulator/dynamics/dynamics.h"

namespace dive::vehicle {

class Flippers {
 public:
  Flippers(const FlipperForces& hips_B, const Aqua2Figures& figures);

  /// Sets the demand on each flipper; rates are clamped to [-1, 1], NaN counts as 0.
  void command(const PseudoRates& rates);
  void advance(double dt);

  [[nodiscard]] const FlipperForces& demand() const { return demand_; }
  [[nodiscard]] const FlipperForces& forces() const { return forces_; }
  /// Electrical power for thrust, W.
  [[nodiscard]] double power() const;

  /// Makes the gait (1 + e) times as fast as nominal: thrust along x is (1 + e)^2 of the demand's.
  void set_speed_scale(double scale) { surge_scale_ = scale * scale; }

 private:
  FlipperForces hips_B_;
  Aqua2Figures figures_;
  double surge_scale_ = 1.0;
  FlipperForces demand_ = FlipperForces::Zero();
  FlipperForces forces_ = FlipperForces::Zero();
};

}  // namespace dive::vehicle
