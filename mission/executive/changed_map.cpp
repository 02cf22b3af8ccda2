#include "mission/executive/changed_map.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "planning/world/sounding.h"

namespace dive::mission {

std::vector<planning::Obstacle> as_obstacles(std::span<const SeenObstacle> seen,
                                             std::size_t before) {
  std::vector<planning::Obstacle> obstacles;
  for (const SeenObstacle& one : seen) {
    obstacles.push_back({fmt::format("seen {}", ++before), planning::Box{one.size}, one.X_WO});
  }
  return obstacles;
}

ChangedMap::ChangedMap(const planning::World& world, const planning::RobotHull& hull)
    : hull_(hull), hull_radius_(hull.radius()), scene_(world), ceiling_(world) {}

void ChangedMap::add(std::span<const SeenObstacle> seen) {
  for (planning::Obstacle& obstacle : as_obstacles(seen, added_.obstacles.size())) {
    added_.obstacles.push_back(std::move(obstacle));
  }
  certifier_ = std::make_unique<planning::Certifier>(added_, hull_);
  added_scene_ = std::make_unique<planning::Scene>(added_);
  added_ceiling_.emplace(added_);
}

bool ChangedMap::overhead(const Eigen::Vector3d& p_W, double margin) {
  const double radius = hull_radius_ + margin;
  return ceiling_.is_above(p_W, radius) ||
         (added_ceiling_ && added_ceiling_->is_above(p_W, radius));
}

std::optional<double> ChangedMap::ground_below(const Eigen::Vector3d& p_W) const {
  std::optional<double> ground = planning::ground_below(scene_, p_W);
  if (!added_scene_) return ground;
  const std::optional<double> seen = planning::ground_below(*added_scene_, p_W);
  if (ground && seen) return std::max(*ground, *seen);
  return seen ? seen : ground;
}

double ChangedMap::clearance(std::span<const Pose> waypoints) {
  if (!certifier_ || waypoints.empty()) return std::numeric_limits<double>::infinity();
  return certifier_->certify(waypoints).clearance_m;
}

}  // namespace dive::mission
