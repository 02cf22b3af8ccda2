#pragma once
// Requests to the planner in the Window environment and elsewhere, for a vehicle that is one box.

#include <algorithm>
#include <limits>
#include <variant>
#include <vector>

#include "common/clock.h"
#include "planning/planner.h"
#include "planning/world/sdf.h"
#include "test/planning/boxes.h"

namespace dive::planning {

inline const Eigen::Vector3d kBodySize(0.80, 0.48, 0.22);
inline const RobotHull kVehicle{{{"body", testing::box_corners(kBodySize)}}};
inline const Eigen::Vector3d kGate(-1.0, -2.0, -4.0);
inline const Eigen::Vector3d kRoomB(9.8, -2.0, -4.6);

inline World window() {
  Diagnostics diagnostics;
  return load_sdf(DIVE_SOURCE_DIR "/missions/maps/window.sdf", diagnostics).value_or(World{});
}

inline PlanRequest ask(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double clearance) {
  PlanRequest request;
  request.start = testing::still(from);
  request.goal = testing::still(to);
  request.limits.clearance = clearance;
  request.limits.attitude = AttitudeMode::kHorizontal;
  return request;
}

inline PlanResult plan(const World& world, const PlanRequest& request,
                       const RobotHull& hull = kVehicle, const PlannerOptions& options = {}) {
  SteadyClock clock;
  return Planner(world, hull, options, clock).plan(request);
}

// Least clearance of the true motion in steps of `step` metres, from the boxes' features and not
// our distances.
inline double clearance_of(const std::vector<Pose>& path, const World& world, double step,
                           const Eigen::Vector3d& body_size = kBodySize) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const int steps = static_cast<int>((path[i + 1].p - path[i].p).norm() / step) + 1;
    for (int k = 0; k <= steps; ++k) {
      const testing::PlacedBox body{
          body_size, interpolate(path[i], path[i + 1], static_cast<double>(k) / steps)};
      for (const Obstacle& obstacle : world.obstacles) {
        const testing::PlacedBox box{std::get<Box>(obstacle.shape).size, obstacle.X_WO};
        if (testing::point_to_box(body.X_W.p, box) > least + body_size.norm() / 2.0) continue;
        least = std::min(least, testing::box_to_box(body, box));
      }
    }
  }
  return least;
}

}  // namespace dive::planning
