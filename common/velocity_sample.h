#pragma once
// A measured velocity, as from a Doppler velocity log (DVL).

#include <Eigen/Core>

#include "common/clock.h"

namespace dive {

/// Over ground.
struct VelocitySample {
  Utime utime = 0;
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();  ///< m/s, of B's origin.
  double sigma = 0.1;                             ///< m/s, per axis.
};

}  // namespace dive
