#include "behaviors/retrace.h"

#include <vector>

namespace dive::behaviors {
namespace {

constexpr double kCaptureRadius = 0.5;
constexpr double kGraceSeconds = 60.0;

vehicle::FollowerOptions follower_options(double speed) {
  vehicle::FollowerOptions options;
  options.speed = speed;
  options.capture_radius = kCaptureRadius;
  return options;
}

// Level poses along the way, each heading for the next.
std::vector<Pose> level_poses(const std::vector<Eigen::Vector3d>& points) {
  std::vector<Pose> poses(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d way = i + 1 < points.size() ? Eigen::Vector3d(points[i + 1] - points[i])
                                                      : Eigen::Vector3d(points[i] - points[i - 1]);
    poses[i] = Pose{points[i], from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()))};
  }
  return poses;
}

}  // namespace

Retrace::Retrace(const Trail& trail, const Eigen::Vector3d& p_W, bool open_above, double speed)
    : follower_(follower_options(speed)), open_above_(open_above) {
  progress_.leg = "open water";
  if (open_above_) return;
  const Trail::WayOut way = trail.way_out(p_W);
  reaches_open_water_ = way.reaches_open_water;
  time_allowed_s_ = kGraceSeconds + 4.0 * way.length_m / speed;
  progress_.distance_to_go_m = way.length_m;
  if (way.points.size() >= 2) follower_.set_path(level_poses(way.points), p_W);
}

BehaviorOutput Retrace::step(const BehaviorInput& input) {
  if (!entered_at_) entered_at_ = input.now;
  const Pose& X_WB = input.estimate->X_WB;
  BehaviorOutput output;
  output.command = station_keeping(-X_WB.p.z(), to_rpy(X_WB.q).z());
  if (open_above_) {
    output.done = true;
    return output;
  }
  if (!reaches_open_water_ || !follower_.has_path() ||
      to_seconds(input.now - *entered_at_) > time_allowed_s_) {
    output.failed = true;
    return output;
  }
  output.command = follower_.step(X_WB, input.estimate->v_WB_B);
  progress_.distance_to_go_m = follower_.status().distance_to_go_m;
  progress_.cross_track_m = follower_.status().cross_track_m;
  progress_.segment = follower_.status().segment;
  output.done = follower_.status().finished;
  return output;
}

}  // namespace dive::behaviors
