#pragma once
// Draws with their order stated: that of a function's arguments is the compiler's.

#include <Eigen/Core>

#include "common/random.h"

namespace dive::vehicle {

/// A vector along x and y with standard deviation `sigma` per axis.
[[nodiscard]] inline Eigen::Vector3d horizontal_draw(Random& random, double sigma) {
  const double x = random.normal();
  const double y = random.normal();
  return {sigma * x, sigma * y, 0.0};
}

}  // namespace dive::vehicle
