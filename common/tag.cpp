#include "common/tag.h"

namespace dive {

Eigen::Quaterniond tag_attitude(double yaw, double pitch_up, double clockwise) {
  // Out of the print x, up z: as a body that looks where the print looks.
  Eigen::Matrix3d R_NT;
  R_NT << 0, 0, -1, 1, 0, 0, 0, -1, 0;
  return (from_rpy(0.0, -pitch_up, yaw) * Eigen::Quaterniond(R_NT) * so3_exp({0.0, 0.0, clockwise}))
      .normalized();
}

}  // namespace dive
