#include "planning/warm_start/free_space.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dive::planning {

using Eigen::Vector3d;

FreeSpace::FreeSpace(const Scene& scene, double radius,
                     std::vector<VirtualObstacle> virtual_obstacles)
    : scene_(scene), radius_(radius), virtual_obstacles_(std::move(virtual_obstacles)) {}

double FreeSpace::slack(const Vector3d& p_W) const {
  double least = scene_.point_distance(p_W) - radius_;
  for (const VirtualObstacle& ball : virtual_obstacles_) {
    least = std::min(least, (p_W - ball.centre_W).norm() - ball.radius);
  }
  return least;
}

bool FreeSpace::is_free(const Vector3d& from_W, const Vector3d& to_W) const {
  const double length = (to_W - from_W).norm();
  if (slack(to_W) < 0.0) return false;
  double done = 0.0;
  while (done < length) {
    const double free = slack(from_W + (to_W - from_W) * (done / length));
    if (free < 0.0) return false;
    done += std::max(free, kStep);
  }
  return true;
}

namespace {

// From each point to the farthest later one in sight.
std::vector<Vector3d> cut_corners(const FreeSpace& space, const std::vector<Vector3d>& path) {
  std::vector<Vector3d> result{path.front()};
  std::size_t at = 0;
  while (at + 1 < path.size()) {
    std::size_t next = path.size() - 1;
    while (next > at + 1 && !space.is_free(path[at], path[next])) --next;
    result.push_back(path[next]);
    at = next;
  }
  return result;
}

}  // namespace

std::vector<Vector3d> shorten(const FreeSpace& space, const std::vector<Vector3d>& path,
                              double spacing) {
  std::vector<Vector3d> result = path;
  for (int pass = 0; pass < 2; ++pass) {
    result = cut_corners(space, resample(result, spacing));
    std::reverse(result.begin(), result.end());
  }
  return result;
}

std::vector<Vector3d> resample(const std::vector<Vector3d>& path, double spacing) {
  std::vector<Vector3d> result;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double length = (path[i + 1] - path[i]).norm();
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / spacing - 1e-9)));
    for (int k = 0; k < pieces; ++k) {
      result.push_back(path[i] + (path[i + 1] - path[i]) * (static_cast<double>(k) / pieces));
    }
  }
  if (!path.empty()) result.push_back(path.back());
  return result;
}

}  // namespace dive::planning
