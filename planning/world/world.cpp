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

ObjectRange object_at(const World& world, int index) {
  DIVE_DEMAND(index >= 0 && index < static_cast<int>(world.obstacles.size()));
  const auto surface_of = [&](int i) {
    return world.obstacles[static_cast<std::size_t>(i)].surface;
  };
  const int surface = surface_of(index);
  ObjectRange object{index, index + 1};
  if (surface < 0) return object;
  while (object.first > 0 && surface_of(object.first - 1) == surface) --object.first;
  const int size = static_cast<int>(world.obstacles.size());
  while (object.end < size && surface_of(object.end) == surface) ++object.end;
  return object;
}

}  // namespace dive::planning
