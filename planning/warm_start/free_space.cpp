#include "planning/warm_start/free_space.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace dive::planning {

using Eigen::Vector3d;

FreeSpace::FreeSpace(const Scene& scene, double radius,
                     std::vector<VirtualObstacle> virtual_obstacles)
    : scene_(scene), radius_(radius), virtual_obstacles_(std::move(virtual_obstacles)) {
  // No position equals NaN.
  known_.fill({Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()), 0.0});
}

double FreeSpace::slack(const Vector3d& p_W) const {
  for (const Known& known : known_) {
    if (known.p_W == p_W) return known.slack;
  }
  known_[oldest_] = {p_W, measure(p_W)};
  const double slack = known_[oldest_].slack;
  oldest_ = (oldest_ + 1) % kKnown;
  return slack;
}

double FreeSpace::measure(const Vector3d& p_W) const {
  double least = scene_.point_distance(p_W) - radius_;
  for (const VirtualObstacle& ball : virtual_obstacles_) {
    least = std::min(least, (p_W - ball.centre_W).norm() - ball.radius);
  }
  return least;
}

bool FreeSpace::is_free(const Vector3d& from_W, const Vector3d& to_W) const {
  const double length = (to_W - from_W).norm();
  const double free_at_end = slack(to_W);
  if (free_at_end < 0.0) return false;
  double free = slack(from_W);
  double done = 0.0;
  while (free >= 0.0) {
    done += std::max(free, kStep);
    if (done + free_at_end >= length) return true;
    free = measure(from_W + (to_W - from_W) * (done / length));
  }
  return false;
}

namespace {

// From each point to the farthest later one that a free straight leg reaches.
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
