#include "behaviors/back_off.h"

#include <cmath>
#include <span>
#include <vector>

namespace dive::behaviors {
namespace {

constexpr double kTooNear = 0.5;   // of D_min
constexpr double kRoom = 0.85;     // of D_min: with that much a start is as good as any ...
constexpr double kNearFor = 2.0;   // ... and with less it may swim so many m
constexpr double kFarthest = 8.0;  // m back along the trail
constexpr double kWorthIt = 0.05;  // m more room than here
constexpr double kTryAgain = 2.0;  // s
constexpr double kGraceSeconds = 15.0;
constexpr double kSlow = 4.0;  // times the time at full speed is not getting on
constexpr double kCaptureRadius = 0.3;

vehicle::FollowerOptions follower_options(double speed) {
  vehicle::FollowerOptions options;
  options.speed = speed;
  options.capture_radius = kCaptureRadius;
  return options;
}

// First on the spot to where the way leads: the turn needs room as well.
std::vector<Pose> poses_of(const Trail::Way& way, const Pose& from_X_WB) {
  std::vector<Pose> poses = level_poses(way.points);
  poses.insert(poses.begin(), from_X_WB);
  return poses;
}

}  // namespace

BackOff::BackOff(double clearance, double speed)
    : clearance_(clearance), speed_(speed), follower_(follower_options(speed)) {}

bool BackOff::is_needed(const BehaviorInput& input) {
  const Eigen::Vector3d& p_W = input.estimate->X_WB.p;
  if (last_W_) tight_m_ += (p_W - *last_W_).norm();
  last_W_ = p_W;
  if (!input.map_changed || input.seen == nullptr || input.trail == nullptr) return false;
  room_m_ = input.seen->clearance({&input.estimate->X_WB, 1});
  if (room_m_ >= kRoom * clearance_) tight_m_ = 0.0;
  if (tried_at_ && to_seconds(input.now - *tried_at_) < kTryAgain) return false;
  return room_m_ < kTooNear * clearance_ || tight_m_ > kNearFor;
}

Trail::Way BackOff::way_back(const BehaviorInput& input) const {
  const Pose& X_WB = input.estimate->X_WB;
  double most_m = room_m_ + kWorthIt;
  Eigen::Vector3d roomiest_W = X_WB.p;
  const auto has_room = [&](const Eigen::Vector3d& p_W) {
    const Eigen::Vector3d way = X_WB.p - p_W;
    const Pose there{p_W, from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()))};
    const double room_m = input.seen->clearance({&there, 1});
    if (room_m > most_m) {
      most_m = room_m;
      roomiest_W = p_W;
    }
    return room_m >= kRoom * clearance_ && room_m > room_m_ + kWorthIt;
  };
  const double link_m = kTrailLinkShare * clearance_;
  Trail::Way way = input.trail->way_to(X_WB.p, link_m, kFarthest, has_room);
  if (way.arrives || roomiest_W == X_WB.p) return way;
  return input.trail->way_to(X_WB.p, link_m, kFarthest,
                             [&](const Eigen::Vector3d& p_W) { return p_W == roomiest_W; });
}

bool BackOff::begin(const BehaviorInput& input) {
  tried_at_ = input.now;
  const Trail::Way way = way_back(input);
  if (!way.arrives || way.points.size() < 2) return false;
  const std::vector<Pose> poses = poses_of(way, input.estimate->X_WB);
  if (input.seen->clearance(poses) <= 0.0) return false;
  follower_.set_path(std::span(poses).subspan(1), input.estimate->X_WB.p);
  until_ = input.now + from_seconds(kGraceSeconds + kSlow * way.length_m / speed_);
  under_way_ = true;
  ++count_;
  return true;
}

std::optional<vehicle::Command> BackOff::follow(const BehaviorInput& input) {
  const vehicle::Command command = follower_.step(input.estimate->X_WB, input.estimate->v_WB_B);
  const vehicle::FollowerStatus& status = follower_.status();
  const auto ahead = static_cast<std::size_t>(status.segment) - 1;
  const bool blocked = input.map_changed && input.seen != nullptr &&
                       input.seen->clearance(follower_.path().subspan(ahead)) <= 0.0;
  if (!status.finished && !blocked && input.now < until_) return command;
  under_way_ = false;
  tight_m_ = 0.0;
  last_W_.reset();
  return std::nullopt;
}

}  // namespace dive::behaviors
