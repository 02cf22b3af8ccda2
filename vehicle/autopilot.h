#pragma once
// PD attitude and depth autopilot at 50 Hz: from the command tuple and the measured state to
// pseudo-rates.

#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vehicle/command.h"

namespace dive::vehicle {

struct AutopilotOptions {
  Eigen::Vector3d attitude_p{1.0, 2.0, 1.5};  ///< Roll, pitch, yaw: effort per rad.
  Eigen::Vector3d attitude_d{0.4, 0.8, 0.8};  ///< Effort per rad/s.
  double depth_p = 1.0;                       ///< Effort per m.
  double depth_d = 1.0;                       ///< Effort per m/s.
  double depth_filter_s = 0.2;                ///< Time constant of the depth rate.
  double full_speed = 0.8;                    ///< m/s at full surge effort (steady, level).

  [[nodiscard]] std::string validate() const;
};

/// Pure; allocates nothing.
class Autopilot {
 public:
  explicit Autopilot(AutopilotOptions options);

  /// `q_WB`, `omega_B` (rad/s) and `depth_m` are measured, `dt` is since the last call (s, > 0).
  [[nodiscard]] PseudoRates step(const Command& command, const Eigen::Quaterniond& q_WB,
                                 const Eigen::Vector3d& omega_B, double depth_m, double dt);

 private:
  AutopilotOptions options_;
  double depth_rate_ = 0.0;
  double last_depth_ = 0.0;
  bool has_depth_ = false;
};

}  // namespace dive::vehicle
