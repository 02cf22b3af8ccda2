#include "planning/world/world.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"
#include "planning/world/primitives.h"

namespace dive::planning {

double RobotHull::radius() const {
  double largest = 0.0;
  for (const ConvexSolid& part : parts) {
    for (const Eigen::Vector3d& vertex : part.vertices) largest = std::max(largest, vertex.norm());
  }
  return largest;
}

Eigen::AlignedBox3d World::bounds() const {
  Eigen::AlignedBox3d all;
  for (const Obstacle& obstacle : obstacles) {
    if (!std::holds_alternative<HalfSpace>(obstacle.shape)) all.extend(bounding_box(obstacle));
  }
  return all;
}

const std::string& object_name(const World& world, int object) {
  DIVE_DEMAND(object >= 0);
  const auto index = static_cast<std::size_t>(object);
  if (index < world.obstacles.size()) return world.obstacles[index].name;
  DIVE_DEMAND(index - world.obstacles.size() < world.surfaces.size());
  return world.surfaces[index - world.obstacles.size()].name;
}

}  // namespace dive::planning
