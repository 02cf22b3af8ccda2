#pragma once
// Dives by an integrator of its own: the equations of estimation/expected_motion.h written down
// again and integrated by Runge-Kutta in steps of a tenth of a tick, with random efforts and turns.

#include <cstdint>

#include "common/motion_model.h"
#include "estimation/motion_fit/motion_record.h"

namespace dive::testing {

struct SyntheticDive {
  MotionModel truth;
  std::uint64_t seed = 1;
  double duration_s = 300.0;
  double turning = 1.0;                                 ///< Factor on all turn rates.
  double heave = 0.4;                                   ///< Largest heave effort.
  Eigen::Vector2d current_W = Eigen::Vector2d::Zero();  ///< m/s
  double fix_sigma_m = 0.02;
  double heading_bias = 0.02;  ///< Of the compass, rad.
  double gyro_bias = 0.01;     ///< rad/s, about every axis.
};

[[nodiscard]] estimation::MotionRecord record_of(const SyntheticDive& dive);

}  // namespace dive::testing
