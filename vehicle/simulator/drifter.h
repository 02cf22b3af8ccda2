#pragma once
// Something small that drifts in the water, without a memory: it goes on for ever through a space
// that repeats itself, and the copy that counts is the one nearest to the lens. What leaves the box
// around the lens on one side enters on the other.

#include <Eigen/Core>

#include "common/random.h"

namespace dive::vehicle {

struct Drifter {
  Eigen::Vector3d start;     ///< In W, m.
  Eigen::Vector3d velocity;  ///< Through the water, m/s.

  /// Anywhere in a box of `side` (m), at `speed` (m/s) in a direction of its own.
  [[nodiscard]] static Drifter draw(Random& random, double side, double speed);

  /// At time t (s), from a lens at `lens_W` in water at rest, in W; no farther than half of `side`
  /// along each axis.
  [[nodiscard]] Eigen::Vector3d from_lens(const Eigen::Vector3d& lens_W, double t,
                                          double side) const;
};

}  // namespace dive::vehicle
