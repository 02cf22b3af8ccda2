#include "common/tag.h"

namespace dive {

Eigen::Quaterniond tag_attitude(double yaw, double pitch_up, double clockwise) {
  // x out of the print, z up: as for a body facing where the print faces.
  Eigen::Matrix3d R_NT;
  R_NT << 0, 0, -1, 1, 0, 0, 0, -1, 0;
  return (from_rpy(0.0, -pitch_up, yaw) * Eigen::Quaterniond(R_NT) * so3_exp({0.0, 0.0, clockwise}))
      .normalized();
}

}  // namespace dive
