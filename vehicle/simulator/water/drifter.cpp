#include "vehicle/simulator/water/drifter.h"

namespace dive::vehicle {

Drifter Drifter::draw(Random& random, double side, double speed) {
  Drifter drifter;
  for (double& x : drifter.start) x = random.uniform(0.0, side);
  for (double& x : drifter.velocity) x = random.normal();
  drifter.velocity *= speed / drifter.velocity.norm();
  return drifter;
}

Eigen::Vector3d Drifter::from_lens(const Eigen::Vector3d& lens_W, double t, double side) const {
  const Eigen::Vector3d p = start + t * velocity - lens_W;
  return p - side * (p / side).array().round().matrix();
}

}  // namespace dive::vehicle
