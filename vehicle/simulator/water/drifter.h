#pragma once
// A small drifting object, stateless: it moves for ever through a periodic space, of which the copy
// nearest to the lens counts. An object that leaves the box around the lens on one side enters on
// the other.

#include <Eigen/Core>

#include "common/random.h"

namespace dive::vehicle {

struct Drifter {
  Eigen::Vector3d start;     ///< Initial position in W, m.
  Eigen::Vector3d velocity;  ///< Velocity through the water, m/s.

  /// A random position in a box of `side` (m), with `speed` (m/s) in a random direction.
  [[nodiscard]] static Drifter draw(Random& random, double side, double speed);

  /// Position relative to the lens at time t (s), for a lens at `lens_W` in water at rest, in W; at
  /// most half of `side` along each axis.
  [[nodiscard]] Eigen::Vector3d from_lens(const Eigen::Vector3d& lens_W, double t,
                                          double side) const;
};

}  // namespace dive::vehicle
