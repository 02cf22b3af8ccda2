#include "common/ground_speed.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"

namespace dive {

std::optional<double> speed_over_ground(const Eigen::Vector3d& direction, double speed,
                                        const Eigen::Vector2d& current_W) {
  const double along = direction.head<2>().dot(current_W);
  const double square = speed * speed - current_W.squaredNorm() + along * along;
  if (square < 0.0) return std::nullopt;
  return along + std::sqrt(square);
}

double swim_time_s(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W, double speed,
                   const Eigen::Vector2d& current_W) {
  DIVE_DEMAND(speed > 0.0);
  const Eigen::Vector3d motion = to_W - from_W;
  const double length = motion.norm();
  if (length <= 0.0) return 0.0;
  const double least = kMinGroundSpeedShare * speed;
  const double over_ground = speed_over_ground(motion / length, speed, current_W).value_or(least);
  return length / std::max(over_ground, least);
}

double swim_time_s(std::span<const Pose> path, double speed, const Eigen::Vector2d& current_W) {
  double time_s = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    time_s += swim_time_s(path[i - 1].p, path[i].p, speed, current_W);
  }
  return time_s;
}

}  // namespace dive
