#include "mission/check/fence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace dive::mission {
namespace {

// Distance (m) from p to the fence's edge, negative outside.
double inside_fence(const std::vector<Eigen::Vector2d>& fence, const Eigen::Vector2d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  bool inside = false;
  for (std::size_t i = 0; i < fence.size(); ++i) {
    const Eigen::Vector2d& a = fence[i];
    const Eigen::Vector2d& b = fence[(i + 1) % fence.size()];
    const Eigen::Vector2d edge = b - a;
    const double along =
        std::clamp((p - a).dot(edge) / std::max(edge.squaredNorm(), 1e-12), 0.0, 1.0);
    nearest = std::min(nearest, (p - a - along * edge).norm());
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * edge.x()) {
      inside = !inside;
    }
  }
  return inside ? nearest : -nearest;
}

}  // namespace

// Samples a straight piece: it lies within a polygon with margin if points at this spacing do.
void check_fence(const std::vector<PlannedRouteLeg>& legs, const Route& route,
                 const Mission& mission, double radius, Diagnostics& diagnostics) {
  std::vector<Eigen::Vector2d> fence;
  for (const auto& [x, y] : mission.failsafes.fence) fence.emplace_back(x.value, y.value);
  if (fence.empty()) return;
  constexpr double kStep = 0.2;  // m
  for (std::size_t l = 0; l < legs.size(); ++l) {
    const std::vector<Pose>& waypoints = legs[l].plan.waypoints;
    for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
      const Eigen::Vector3d step = waypoints[i + 1].p - waypoints[i].p;
      const int pieces = std::max(1, static_cast<int>(std::ceil(step.norm() / kStep)));
      for (int k = 0; k <= pieces; ++k) {
        const Eigen::Vector3d p = waypoints[i].p + static_cast<double>(k) / pieces * step;
        if (inside_fence(fence, p.head<2>()) >= radius + 0.5 * kStep) continue;
        diagnostics.error("CHK-FENCE", mission.source, route.legs[l].span,
                          fmt::format("on the path to '{}' the vehicle crosses the geofence at "
                                      "({:.1f}, {:.1f})",
                                      legs[l].goal, p.x(), p.y()));
        return;
      }
    }
  }
}

}  // namespace dive::mission
