#include "planning/mapping/swept_hull.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace dive::planning {
namespace {

using Eigen::Vector3f;

constexpr int kSteps = 15;
constexpr float kTimeStep = static_cast<float>(SweptHull::kHorizon) / kSteps;  // s
constexpr float kNeighbour = 0.06F;  // m between two points of one surface
constexpr float kMinSize = 0.08F;    // m, diagonal of the box of a surface: larger than a particle

// From B at the time of the scan to B later.
struct Motion {
  Eigen::Matrix3f R;
  Vector3f p;
};

struct Hit {
  float time_s;
  Vector3f p_B;
};

// The poses after each step along the way; the last one once the way has ended.
std::array<Motion, kSteps> predict(std::span<const Pose> way_W, double speed) {
  std::array<Motion, kSteps> motion;
  const Pose X_BW = way_W.front().inverse();
  std::size_t next = 1;
  Pose at = way_W.front();
  for (Motion& later : motion) {
    double left = speed * static_cast<double>(kTimeStep);
    while (next < way_W.size()) {
      const double length = (way_W[next].p - at.p).norm();
      if (length > left) {
        at = interpolate(at, way_W[next], left / length);
        break;
      }
      left -= length;
      at = way_W[next++];
    }
    const Pose X_LB = (X_BW * at).inverse();  // from B at the time of the scan to B later
    later.R = X_LB.q.toRotationMatrix().cast<float>();
    later.p = X_LB.p.cast<float>();
  }
  return motion;
}

// True if the points that are connected with `from` are larger than a particle. Visits them only
// until they are, and removes them from `points`.
bool is_surface(const Vector3f& from, std::vector<Vector3f>& points) {
  Eigen::AlignedBox3f box(from);
  std::vector<Vector3f> patch = {from};
  for (std::size_t i = 0; i < patch.size() && box.diagonal().norm() < kMinSize; ++i) {
    const Vector3f at = patch[i];
    const auto beside = std::ranges::partition(points, [&](const Vector3f& p) {
      return (p - at).squaredNorm() > kNeighbour * kNeighbour;
    });
    for (const Vector3f& p : beside) box.extend(p);
    patch.insert(patch.end(), beside.begin(), beside.end());
    points.erase(beside.begin(), beside.end());
  }
  return box.diagonal().norm() >= kMinSize;
}

}  // namespace

SweptHull::SweptHull(const RobotHull& hull) {
  for (const Eigen::Vector3d& vertex : hull.hull_vertices()) box_B_.extend(vertex.cast<float>());
  radius_ = box_B_.min().cwiseAbs().cwiseMax(box_B_.max().cwiseAbs()).norm();
}

std::optional<ObstacleAhead> SweptHull::first_obstacle(const RangeScan& scan,
                                                       std::span<const Pose> way_W,
                                                       double speed) const {
  if (way_W.size() < 2) return std::nullopt;
  constexpr auto kMarginF = static_cast<float>(kMargin);
  const std::array<Motion, kSteps> motion = predict(way_W, speed);
  const float farthest = radius_ + kMarginF + static_cast<float>(speed * kHorizon);
  std::vector<Hit> hits;
  std::vector<Vector3f> near;
  for (const Vector3f& p_B : scan.points_B) {
    if (!(p_B.squaredNorm() < farthest * farthest)) continue;  // NaN: no range
    const float now_m = box_B_.exteriorDistance(p_B);
    if (now_m <= 0.0F) continue;  // the vehicle itself
    near.push_back(p_B);
    const float margin = std::min(kMarginF, 0.5F * now_m);
    for (int i = 0; i < kSteps; ++i) {
      const Motion& later = motion[static_cast<std::size_t>(i)];
      if (box_B_.exteriorDistance(Vector3f(later.R * p_B + later.p)) > margin) continue;
      hits.push_back({static_cast<float>(i + 1) * kTimeStep, p_B});
      break;
    }
  }
  std::ranges::sort(hits, {}, &Hit::time_s);
  const auto first =
      std::ranges::find_if(hits, [&](const Hit& hit) { return is_surface(hit.p_B, near); });
  if (first == hits.end()) return std::nullopt;
  return ObstacleAhead{scan.utime, static_cast<double>(first->time_s), first->p_B.cast<double>()};
}

}  // namespace dive::planning
