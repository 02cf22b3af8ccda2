#include "planning/world/nearest_in_hull.h"

#include <algorithm>
#include <limits>

#include "planning/world/corral.h"

namespace dive::planning {

using Eigen::Vector3d;

Vector3d nearest_in_hull(std::span<const Vector3d> points, const Vector3d& p) {
  const auto farthest_along = [&](const Vector3d& n) {
    std::size_t best = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (const double along = n.dot(points[i]); along > most) {
        most = along;
        best = i;
      }
    }
    return best;
  };
  const auto nearest = std::ranges::min_element(
      points, {}, [&](const Vector3d& v) { return (v - p).squaredNorm(); });
  Vector3d x = *nearest - p;
  Corral corral(x, 0);
  for (int round = 0; round < 100; ++round) {
    const Vector3d v = points[farthest_along(-x)] - p;
    if (x.squaredNorm() - x.dot(v) <= 1e-14 * (1.0 + v.squaredNorm()) || corral.full()) break;
    corral.add(v, 0);
    if (!corral.settle()) break;
    const Vector3d next = corral.point();
    if (next.squaredNorm() >= x.squaredNorm()) break;
    x = next;
  }
  return p + x;
}

}  // namespace dive::planning
