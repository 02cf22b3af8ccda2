// Initial paths for the optimiser.

#include <algorithm>
#include <cmath>

#include "common/assert.h"
#include "planning/trajopt/trajopt.h"

namespace dive::planning {
namespace {

double yaw_of(const Eigen::Quaterniond& q) { return to_rpy(q).z(); }

Eigen::Quaterniond along(const Eigen::Vector3d& motion, AttitudeMode mode,
                         const Eigen::Quaterniond& fallback) {
  if (mode != AttitudeMode::kHorizontal) {
    return motion.norm() > 1e-9 ? heading_along(motion, yaw_of(fallback)) : fallback;
  }
  const bool moves = motion.head<2>().norm() > 1e-6;
  return from_rpy(0.0, 0.0, moves ? std::atan2(motion.y(), motion.x()) : yaw_of(fallback));
}

}  // namespace

std::vector<Pose> poses_along(std::span<const Eigen::Vector3d> positions, const Pose& start,
                              const Pose& goal, AttitudeMode mode) {
  DIVE_DEMAND(positions.size() >= 2);
  std::vector<Pose> poses(positions.size());
  poses.front() = start;
  for (std::size_t i = 1; i < positions.size(); ++i) {
    const std::size_t next = std::min(i + 1, positions.size() - 1);
    poses[i].p = positions[i];
    poses[i].q = along(positions[next] - positions[i - 1], mode, poses[i - 1].q);
  }
  poses.back().p = goal.p;
  return poses;
}

std::vector<Pose> straight_line(const Pose& start, const Pose& goal, AttitudeMode mode,
                                double spacing) {
  DIVE_DEMAND(spacing > 0.0);
  const double length = (goal.p - start.p).norm();
  const int segments = std::max(2, static_cast<int>(std::ceil(length / spacing)));
  std::vector<Eigen::Vector3d> positions;
  for (int i = 0; i <= segments; ++i) {
    positions.push_back(start.p + (goal.p - start.p) * i / segments);
  }
  return poses_along(positions, start, goal, mode);
}

}  // namespace dive::planning
