#include "mission/report/followed_path.h"

#include <cmath>

namespace dive::mission {
namespace {

constexpr double kSame = 1e-6;       // m
constexpr double kMinLength = 1e-9;  // m: a shorter segment has no direction
constexpr std::size_t kNewest = 4;   // paths, of which the newer ones may have been refused

}  // namespace

double FollowedLine::distance(const Eigen::Vector3d& p_W) const {
  const Eigen::Vector3d direction = (end_W - start_W).normalized();
  const Eigen::Vector3d from_start = p_W - start_W;
  return (from_start - direction.dot(from_start) * direction).norm();
}

std::optional<FollowedLine> followed_line(const std::vector<ReportPath>& paths,
                                          const Status& status,
                                          const Eigen::Vector3d& estimated_W) {
  if (status.segment < 1) return std::nullopt;
  const auto segment = static_cast<std::size_t>(status.segment);
  std::size_t tried = 0;
  for (std::size_t i = paths.size(); i-- > 0 && tried < kNewest;) {
    const planning::PlanResult& plan = paths[i].plan;
    if (!plan.accepted) continue;
    ++tried;
    if (segment >= plan.waypoints.size()) continue;
    const FollowedLine line{i, plan.waypoints[segment - 1].p, plan.waypoints[segment].p};
    if ((line.end_W - line.start_W).norm() < kMinLength) continue;
    if (std::abs(line.distance(estimated_W) - status.cross_track_m) < kSame) return line;
  }
  return std::nullopt;
}

}  // namespace dive::mission
