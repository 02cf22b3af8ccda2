#include "mission/onboard/exit_path_service.h"

#include <algorithm>

namespace dive::mission {
namespace {

constexpr double kMargin = 2.0;  // m around the path within which observed obstacles count

}  // namespace

ExitPathService::ExitPathService(const planning::World& known, const planning::RobotHull& hull)
    : known_(known), certifier_(known, hull, {.cutoff = kCutoff}), worker_(OnLate::kPoll) {}

double ExitPathService::clearance(const vehicle::ExitPath& path,
                                  const planning::ObservedMap& observed) {
  if (path.waypoints.empty()) return 0.0;
  if (const auto certified = worker_.poll(path.utime)) newest_ = *certified;
  if (newest_.revision == path.revision) return newest_.clearance_m;
  if (asked_ != path.revision && worker_.has_finished()) {
    asked_ = path.revision;
    worker_.start(path.utime, [this, path, observed] { return certify(path, observed); });
  }
  return 0.0;
}

ExitPathService::Certified ExitPathService::certify(const vehicle::ExitPath& path,
                                                    const planning::ObservedMap& observed) {
  planning::World world = planning::without(known_, observed.absent());
  Eigen::AlignedBox3d around;
  for (const Pose& waypoint : path.waypoints) around.extend(waypoint.p);
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kMargin);
  observed.append_within({around.min() - margin, around.max() + margin}, world.obstacles);
  certifier_.reset(world, {.cutoff = kCutoff});
  return {path.revision, std::max(certifier_.certify(path.waypoints).clearance_m, 0.0)};
}

}  // namespace dive::mission
