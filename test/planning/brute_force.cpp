#include "test/planning/brute_force.h"

#include <algorithm>
#include <cmath>

#include "vehicle/simulator/ground_truth/ground_truth.h"

namespace dive::testing {

double measured_clearance(const planning::World& world, const planning::RobotHull& hull,
                          const std::vector<Pose>& path, double interesting) {
  constexpr double kStep = 1e-3;
  const vehicle::ClearanceMeter meter(world, hull);
  double least = meter.clearance(path.back());
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Eigen::AngleAxisd turn(path[i].q.conjugate() * path[i + 1].q);
    const double moved =
        (path[i + 1].p - path[i].p).norm() + hull.radius() * std::abs(turn.angle());
    for (double at = 0.0; at < moved;) {
      const double t = at / moved;
      Pose pose;
      pose.p = path[i].p + t * (path[i + 1].p - path[i].p);
      pose.q = path[i].q * Eigen::Quaterniond(Eigen::AngleAxisd(t * turn.angle(), turn.axis()));
      const double clearance = meter.clearance(pose);
      least = std::min(least, clearance);
      at += std::max(kStep, clearance - interesting);
    }
  }
  return least;
}

double measured_too_little(const planning::World& world) {
  constexpr double kRounder = 5e-3;
  double radius = 0.0;
  for (const planning::Obstacle& obstacle : world.obstacles) {
    if (const auto* cylinder = std::get_if<planning::Cylinder>(&obstacle.shape)) {
      radius = std::max(radius, cylinder->radius);
    }
  }
  return kRounder * radius;
}

}  // namespace dive::testing
