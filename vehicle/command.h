#pragma once
// Commands to the vehicle.

#include <Eigen/Geometry>

namespace dive::vehicle {

/// The paper's tuple <v, h, d, o>: forward speed, heave, depth, orientation. h is always 0: d sets
/// the depth.
struct Command {
  double v = 0.0;                                         ///< Forward speed, m/s.
  double h = 0.0;                                         ///< Heave, m/s; 0.
  double d = 0.0;                                         ///< Depth, m, positive down.
  Eigen::Quaterniond o = Eigen::Quaterniond::Identity();  ///< Attitude q_WB.
};

/// The autopilot's command to the gait: fractions of full effort, each in [-1, 1], in body axes (x
/// forward, y left, z up; right-hand rule). The real vehicle's pseudo-rates have other signs (yaw +
/// = right, pitch + = forwards down); the link converts them.
struct PseudoRates {
  double surge = 0.0;
  double heave = 0.0;
  double roll = 0.0;
  double pitch = 0.0;
  double yaw = 0.0;
};

}  // namespace dive::vehicle
