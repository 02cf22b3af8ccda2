#include "planning/world/sounding.h"

namespace dive::planning {

std::optional<double> ground_below(const Scene& scene, const Eigen::Vector3d& p_W, double range) {
  constexpr double kTouch = 1e-3;    // m: nearer counts as touching
  constexpr int kMaxSteps = 10'000;  // along a long wall the steps are short, but they advance
  Eigen::Vector3d at = p_W;
  for (int step = 0; step < kMaxSteps && p_W.z() - at.z() <= range; ++step) {
    const double distance = scene.point_distance(at);
    if (distance < kTouch) return at.z();
    at.z() -= distance;
  }
  return std::nullopt;
}

}  // namespace dive::planning
